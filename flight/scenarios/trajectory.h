// Where the vehicle ought to be at every time: holds, straight moves, circles and figures, one after the
// other.
#pragma once

#include "flight/controllers/controller.h"

#include <vector>

namespace tunnelrig {

/// One piece. Lengths in metres in the flight frame (y right of the middle, z above the lower edge).
struct Segment {
  enum class Kind { kHold, kMove, kCircle, kFigure };

  Kind kind = Kind::kHold;
  double duration_s = 0;
  Plane from_m{};  // kHold, kMove
  Plane to_m{};    // kMove
  double acceleration_m_s2 =
      0;                 // kMove: ± this, half the way each (6.8), or until the speed limit is reached
  double speed_m_s = 0;  // kMove: the limit, 0 for none
  Plane centre_m{};      // kCircle, kFigure
  Plane amplitude_m{};  // y = centre + a sin(ω t), z = centre + a cos(ω t) as in (6.31) with its t in seconds
  Plane rate_rad_s{};  // the same in y and z for a circle

  PlanarReference at(double time_s) const;
};

class Trajectory {
 public:
  void hold(const Plane& at_m, double duration_s);
  void move(const Plane& to_m, double acceleration_m_s2, double speed_m_s = 0);
  void circle(const Plane& centre_m, double radius_m, double rate_rad_s, double turns);
  void figure(const Plane& centre_m, const Plane& amplitude_m, const Plane& rate_rad_s, double duration_s);

  /// Before the start and after the end it stands still.
  PlanarReference at(double time_s) const;
  double duration_s() const { return starts_s_.empty() ? 0 : starts_s_.back() + segments_.back().duration_s; }
  const std::vector<Segment>& segments() const { return segments_; }

  /// Mirrored at y = 0.
  Trajectory mirrored() const;

 private:
  void add(const Segment& segment);
  Plane end() const { return at(duration_s() + 1).position_m; }

  std::vector<Segment> segments_;
  std::vector<double> starts_s_;
};

}  // namespace tunnelrig
