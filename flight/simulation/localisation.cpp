#include "flight/simulation/localisation.h"

#include "flight/simulation/flight_loop.h"

#include <algorithm>

#include <Eigen/LU>

namespace tunnelrig {
namespace {

MatcherSettings matcher_settings(const FlightTunnel& tunnel, const LidarSettings& lidar) {
  MatcherSettings settings;
  settings.layout = lidar.layout;
  if (tunnel.circle_diameter_m > 0) {
    settings.form = HoughForm::circle;
    settings.circle_diameter_m = tunnel.circle_diameter_m;
  } else if (tunnel.section.vertices().size() > 4) {
    settings.form = HoughForm::all_directions;
  }
  return settings;
}

}  // namespace

Localisation::Localisation(const FlightSpace& space, const LocalisationSettings& settings)
    : floor_m_(space.floor_m),
      settings_(settings),
      section_(&space.tunnel.section),
      matcher_(space.tunnel.section, matcher_settings(space.tunnel, settings.lidar)),
      filter_(InertialFilter({0, 0})) {}

void Localisation::prepare(std::uint64_t seed, std::uint64_t stream) {
  lidar_.emplace(*section_, settings_.lidar, Random(seed, 4 * stream + 3).bits());
}

void Localisation::start(const RigidState& truth) {
  if (!lidar_) prepare(0, 0);
  const Eigen::Vector2d at(truth.position_m[1], truth.position_m[2] + floor_m_);
  if (settings_.filter == FlightFilter::inertial) {
    filter_ = InertialFilter(at, settings_.inertial, settings_.gate, settings_.start);
  } else {
    filter_ = KalmanFilter(at, settings_.kinematic, settings_.gate, settings_.start);
  }
  cycle_ = nees_count_ = 0;
  matches_ = rejected_ = rejected_in_a_row_ = 0;
  nees_sum_ = 0;
  waiting_ = false;
}

PlanarEstimate Localisation::step(const EstimatorInput& in) {
  const RigidState& truth = *in.truth;
  const EulerAngles true_angles = euler_angles(truth.attitude);
  moments_[static_cast<std::size_t>(cycle_) % kRemembered] = {
      {{truth.position_m[1], truth.position_m[2] + floor_m_},
       {true_angles.roll_rad, true_angles.pitch_rad, true_angles.yaw_rad}},
      {in.attitude.roll_rad, in.attitude.pitch_rad, in.attitude.yaw_rad}};
  if (cycle_ > 0) {
    const Eigen::Vector2d acceleration(in.acceleration_m_s2[0], in.acceleration_m_s2[1]);
    std::visit([&](auto& filter) { filter.predict(acceleration, kControlStep_s); }, filter_);
  }
  const long phase = cycle_ % settings_.cycles_per_scan;
  if (cycle_ >= settings_.cycles_per_scan && phase == 0) take_scan();
  if (waiting_ && phase == settings_.cycles_of_latency) correct();
  ++cycle_;
  judge(truth);
  const Eigen::Vector4d state = kinematic_state();
  return {{state[0], state[1] - floor_m_}, {state[2], state[3]}};
}

/// As it was between two cycles.
Localisation::Moment Localisation::moment_ago(double ago_s) const {
  const double cycles = ago_s * kControlRate_Hz;
  const auto whole = static_cast<long>(cycles);
  const Moment& later = moments_[static_cast<std::size_t>(cycle_ - whole) % kRemembered];
  const Moment& earlier = moments_[static_cast<std::size_t>(cycle_ - whole - 1) % kRemembered];
  const double part = cycles - static_cast<double>(whole);
  const auto between = [&](double from, double to) { return from + part * (to - from); };
  const auto attitude = [&](const Attitude& from, const Attitude& to) -> Attitude {
    return {between(from.roll_rad, to.roll_rad), between(from.pitch_rad, to.pitch_rad),
            between(from.yaw_rad, to.yaw_rad)};
  };
  return {{later.pose.position + part * (earlier.pose.position - later.pose.position),
           attitude(later.pose.attitude, earlier.pose.attitude)},
          attitude(later.measured, earlier.measured)};
}

void Localisation::take_scan() {
  const double sweep_s = settings_.lidar.sweep_s;
  std::array<LidarPose, kPosesOfSweep> path;
  std::array<Attitude, kPosesOfSweep> measured;
  for (std::size_t i = 0; i < kPosesOfSweep; ++i) {
    const Moment moment = moment_ago(sweep_s * (1 - static_cast<double>(i) / (kPosesOfSweep - 1)));
    path[i] = moment.pose;
    measured[i] = moment.measured;
  }
  scan_ = lidar_->sweep(path);
  if (const double now_s = static_cast<double>(cycle_) * kControlStep_s;
      now_s >= settings_.blind_from_s && now_s < settings_.blind_to_s)
    std::fill(scan_.range_m.begin(), scan_.range_m.end(), 0.0F);

  const Attitude &first = measured.front(), &middle = measured[kPosesOfSweep / 2], &last = measured.back();
  scan_attitude_ = middle;
  if (settings_.filter == FlightFilter::inertial) {
    scan_motion_ = {.sweep_s = sweep_s,
                    .velocity_m_s = kinematic_state().tail<2>(),
                    .roll_rate_rad_s = (last.roll_rad - first.roll_rad) / sweep_s,
                    .roll_acceleration_rad_s2 =
                        4 * (last.roll_rad - 2 * middle.roll_rad + first.roll_rad) / (sweep_s * sweep_s)};
  }
  waiting_ = true;
}

void Localisation::correct() {
  waiting_ = false;
  ++matches_;
  if (use_scan()) {
    rejected_in_a_row_ = 0;
  } else {
    ++rejected_;
    ++rejected_in_a_row_;
  }
}

bool Localisation::use_scan() {
  if (!ScanMatcher::can_match(scan_attitude_))
    return false;  // it is overturning, and may be lost before long
  const Match match = matcher_.match(scan_, scan_attitude_, prior(), scan_motion_);
  if (!match.accepted) return false;
  const MeasuredPosition position = measured(match);
  return std::visit([&](auto& filter) { return filter.correct(position).accepted; }, filter_);
}

/// Nothing after as many rejections in a row as make the filter doubt itself: around a place that is wrong no
/// scan fits, so that none would ever reach the filter to put it right.
std::optional<SearchPrior> Localisation::prior() const {
  if (settings_.gate.most_rejections > 0 && rejected_in_a_row_ >= settings_.gate.most_rejections) return {};
  const Eigen::Vector2d variance_m2 = std::visit(
      [](const auto& filter) -> Eigen::Vector2d { return filter.covariance().diagonal().template head<2>(); },
      filter_);
  return SearchPrior(kinematic_state().head<2>(), variance_m2.cwiseMax(0).cwiseSqrt());
}

MeasuredPosition Localisation::measured(const Match& match) {
  const double age_s = settings_.cycles_of_latency * kControlStep_s + 0.5 * settings_.lidar.sweep_s;
  const Eigen::Vector2d per_roll_m = matcher_.moved_per_roll_m();
  MeasuredPosition result{match.position_m, match.covariance_m2, age_s, per_roll_m};
  if (settings_.filter == FlightFilter::thesis) {  // to which the attitude's error is noise
    const Eigen::Vector2d by_roll_m = settings_.start.roll_sigma_rad * per_roll_m;
    result.covariance_m2 += by_roll_m * by_roll_m.transpose();
  }
  return result;
}

Eigen::Vector4d Localisation::kinematic_state() const {
  return std::visit([](const auto& filter) -> Eigen::Vector4d { return filter.state().template head<4>(); },
                    filter_);
}

/// Normalised estimation error squared of position and velocity: 4 on average for an honest filter.
void Localisation::judge(const RigidState& truth) {
  if (cycle_ % settings_.cycles_per_scan != 0) return;
  const auto& v = truth.velocity_m_s;
  const Eigen::Vector4d error =
      Eigen::Vector4d(truth.position_m[1], truth.position_m[2] + floor_m_, v[1], v[2]) - kinematic_state();
  const Eigen::Matrix4d covariance = std::visit(
      [](const auto& filter) -> Eigen::Matrix4d {
        return filter.covariance().template topLeftCorner<4, 4>();
      },
      filter_);
  nees_sum_ += error.dot(covariance.inverse() * error);
  ++nees_count_;
}

void Localisation::finish(FlightScore& score) const {
  score.nees = nees_count_ > 0 ? nees_sum_ / static_cast<double>(nees_count_) : 0;
  score.matches = matches_;
  score.rejected_matches = rejected_;
}

template FlightScore fly<Localisation>(const FlightSetup&, Localisation&, AnyController&, FlightLog*);

}  // namespace tunnelrig
