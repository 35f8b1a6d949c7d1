#include "flight/scenarios/trajectory.h"

#include <cmath>
#include <numbers>

namespace tunnelrig {
namespace {

/// Way, speed and acceleration of a move of this length at a time.
struct Progress {
  double way, speed, acceleration;
};

double time_to_speed(double length, double acceleration, double speed_limit) {
  const double half_way = std::sqrt(length / acceleration);
  return speed_limit > 0 ? std::min(half_way, speed_limit / acceleration) : half_way;
}

double move_duration(double length, double acceleration, double speed_limit) {
  const double ramp = time_to_speed(length, acceleration, speed_limit);
  return ramp > 0 ? ramp + length / (acceleration * ramp) : 0;
}

Progress progress(double t, double length, double acceleration, double speed_limit) {
  const double ramp = time_to_speed(length, acceleration, speed_limit);
  const double duration = move_duration(length, acceleration, speed_limit);
  if (t < ramp) return {0.5 * acceleration * t * t, acceleration * t, acceleration};
  if (t <= duration - ramp) return {acceleration * ramp * (t - 0.5 * ramp), acceleration * ramp, 0};
  const double left = duration - t;
  return {length - 0.5 * acceleration * left * left, acceleration * left, -acceleration};
}

}  // namespace

PlanarReference Segment::at(double t) const {
  PlanarReference r;
  switch (kind) {
    case Kind::kHold:
      r.position_m = from_m;
      break;
    case Kind::kMove: {
      const Plane way = {to_m[0] - from_m[0], to_m[1] - from_m[1]};
      const double length = std::hypot(way[0], way[1]);
      const Progress p = progress(t, length, acceleration_m_s2, speed_m_s);
      for (std::size_t i = 0; i < 2; ++i) {
        const double unit = length > 0 ? way[i] / length : 0;
        r.position_m[i] = from_m[i] + unit * p.way;
        r.velocity_m_s[i] = unit * p.speed;
        r.acceleration_m_s2[i] = unit * p.acceleration;
      }
      break;
    }
    case Kind::kCircle:
    case Kind::kFigure: {
      const double wy = rate_rad_s[0], wz = rate_rad_s[1], ay = amplitude_m[0], az = amplitude_m[1];
      const double sy = std::sin(wy * t), cy = std::cos(wy * t);
      const double sz = wz == wy ? sy : std::sin(wz * t), cz = wz == wy ? cy : std::cos(wz * t);
      r.position_m = {centre_m[0] + ay * sy, centre_m[1] + az * cz};
      r.velocity_m_s = {ay * wy * cy, -az * wz * sz};
      r.acceleration_m_s2 = {-ay * wy * wy * sy, -az * wz * wz * cz};
      r.jerk_m_s3 = {-ay * wy * wy * wy * cy, az * wz * wz * wz * sz};
      break;
    }
  }
  return r;
}

void Trajectory::add(const Segment& segment) {
  starts_s_.push_back(duration_s());
  segments_.push_back(segment);
}

void Trajectory::hold(const Plane& at_m, double duration_s) {
  add({.kind = Segment::Kind::kHold, .duration_s = duration_s, .from_m = at_m});
}

void Trajectory::move(const Plane& to_m, double acceleration_m_s2, double speed_m_s) {
  const Plane from = end();
  const double length = std::hypot(to_m[0] - from[0], to_m[1] - from[1]);
  add({.kind = Segment::Kind::kMove,
       .duration_s = move_duration(length, acceleration_m_s2, speed_m_s),
       .from_m = from,
       .to_m = to_m,
       .acceleration_m_s2 = acceleration_m_s2,
       .speed_m_s = speed_m_s});
}

void Trajectory::circle(const Plane& centre_m, double radius_m, double rate_rad_s, double turns) {
  add({.kind = Segment::Kind::kCircle,
       .duration_s = turns * 2 * std::numbers::pi / std::abs(rate_rad_s),
       .centre_m = centre_m,
       .amplitude_m = {radius_m, radius_m},
       .rate_rad_s = {rate_rad_s, rate_rad_s}});
}

void Trajectory::figure(const Plane& centre_m, const Plane& amplitude_m, const Plane& rate_rad_s,
                        double duration_s) {
  add({.kind = Segment::Kind::kFigure,
       .duration_s = duration_s,
       .centre_m = centre_m,
       .amplitude_m = amplitude_m,
       .rate_rad_s = rate_rad_s});
}

PlanarReference Trajectory::at(double time_s) const {
  if (segments_.empty()) return {};
  std::size_t i = segments_.size() - 1;
  while (i > 0 && starts_s_[i] > time_s) --i;
  const double within = time_s - starts_s_[i];
  if (within >= 0 && within <= segments_[i].duration_s) return segments_[i].at(within);
  return {.position_m = segments_[i].at(within < 0 ? 0 : segments_[i].duration_s).position_m};
}

Trajectory Trajectory::mirrored() const {
  Trajectory result = *this;
  for (Segment& s : result.segments_) {
    s.from_m[0] = -s.from_m[0];
    s.to_m[0] = -s.to_m[0];
    s.centre_m[0] = -s.centre_m[0];
    s.amplitude_m[0] = -s.amplitude_m[0];
  }
  return result;
}

}  // namespace tunnelrig
