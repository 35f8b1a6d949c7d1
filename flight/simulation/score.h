// What a flight is judged by, gathered without allocation while it flies.
#pragma once

#include "flight/controllers/controller.h"

#include <array>
#include <cstdint>
#include <vector>

namespace tunnelrig {

/// Errors of one axis: sum of squares, largest, and a histogram for quantiles.
class AxisErrors {
 public:
  void add(double error_m) {
    const double size = error_m < 0 ? -error_m : error_m;
    squares_ += error_m * error_m;
    largest_m_ = size > largest_m_ ? size : largest_m_;
    const auto bin = static_cast<std::size_t>(size * kPerMetre);
    ++bins_[bin < kBins ? bin : kBins - 1];
    ++count_;
  }
  void add(const AxisErrors& other);

  std::uint64_t count() const { return count_; }
  double rms_m() const;
  double largest_m() const { return largest_m_; }

  /// Upper end of the bin of 0.5 mm that holds this share of all errors' sizes; errors above 1 m are put at 1
  /// m.
  double quantile_m(double share) const;

 private:
  static constexpr double kPerMetre = 2000;
  static constexpr std::size_t kBins = 2001;

  double squares_ = 0, largest_m_ = 0;
  std::uint64_t count_ = 0;
  std::array<std::uint32_t, kBins> bins_{};
};

struct ContactEvent {
  double time_s = 0;
  double y_m = 0, z_m = 0;  // the vehicle's centre
  double touched_y_m = 0, touched_z_m = 0;
  double speed_m_s = 0;  // into the wall
};

/// One flight, or several pooled.
struct FlightScore {
  std::array<AxisErrors, 2> tracking;   // y, z: reference less position, from the scored time on
  std::array<AxisErrors, 2> estimator;  // estimate less position
  std::vector<ContactEvent> contacts;   // the first 64
  int contact_count = 0;
  double effort_N = 0;     // rms of a rotor's commanded thrust about a quarter of the weight
  double saturated_s = 0;  // any motor at a limit
  double clamped_s = 0;    // outside the map
  double nees = 0;         // mean of the estimator's normalised squared error, 0 where it has none
  int rejected_matches = 0, matches = 0;
  double duration_s = 0, scored_s = 0;
  bool lost = false;  // it overturned, or its numbers ran away: the flight ended there

  /// √(rms_y² + rms_z²)
  double rms_m() const;
};

}  // namespace tunnelrig
