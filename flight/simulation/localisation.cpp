#include "flight/simulation/localisation.h"

#include "flight/simulation/flight_loop.h"

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
      matcher_(space.tunnel.section, matcher_settings(space.tunnel, settings.lidar)) {}

void Localisation::prepare(std::uint64_t seed, std::uint64_t stream) {
  lidar_.emplace(*section_, settings_.lidar, Random(seed, 4 * stream + 3).bits());
}

void Localisation::start(const RigidState& truth) {
  if (!lidar_) prepare(0, 0);
  filter_.emplace(Eigen::Vector2d(truth.position_m[1], truth.position_m[2] + floor_m_), settings_.model,
                  settings_.gate);
  cycle_ = nees_count_ = 0;
  matches_ = rejected_ = 0;
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
  if (cycle_ > 0) filter_->predict({in.acceleration_m_s2[0], in.acceleration_m_s2[1]}, kControlStep_s);
  const long phase = cycle_ % settings_.cycles_per_scan;
  if (cycle_ >= settings_.cycles_per_scan && phase == 0) take_scan();
  if (waiting_ && phase == settings_.cycles_of_latency) correct();
  ++cycle_;
  judge(truth);
  const Eigen::Vector2d position = filter_->position_m(), velocity = filter_->velocity_m_s();
  return {{position.x(), position.y() - floor_m_}, {velocity.x(), velocity.y()}};
}

void Localisation::take_scan() {
  const auto cycles = static_cast<long>(std::lround(settings_.lidar.sweep_s / kControlStep_s));
  const auto at = [&](long cycle) -> const Moment& {
    return moments_[static_cast<std::size_t>(cycle) % kRemembered];
  };
  scan_ = lidar_->sweep(at(cycle_ - cycles).pose, at(cycle_).pose);
  // Motion within the sweep is small and nearly uniform: the scan counts as taken in its middle.
  const Attitude &from = at(cycle_ - cycles).measured, &to = at(cycle_).measured;
  scan_attitude_ = {0.5 * (from.roll_rad + to.roll_rad), 0.5 * (from.pitch_rad + to.pitch_rad),
                    0.5 * (from.yaw_rad + to.yaw_rad)};
  waiting_ = true;
}

void Localisation::correct() {
  waiting_ = false;
  const Match match = matcher_.match(scan_, scan_attitude_, filter_->position_m());
  ++matches_;
  bool used = match.accepted;
  if (used) {
    const double age_s = settings_.cycles_of_latency * kControlStep_s + 0.5 * settings_.lidar.sweep_s;
    constexpr double kBlindSpot_m2 = 0.1;  // what it leaves of the effect in the centre
    const double turned = settings_.attitude_sigma_rad * settings_.attitude_sigma_rad *
                          (match.position_m.squaredNorm() + kBlindSpot_m2);
    used =
        filter_->correct(match.position_m, match.covariance_m2 + turned * Eigen::Matrix2d::Identity(), age_s)
            .accepted;
  }
  if (!used) ++rejected_;
}

/// Normalised estimation error squared of position and velocity: 4 on average for an honest filter.
void Localisation::judge(const RigidState& truth) {
  if (cycle_ % settings_.cycles_per_scan != 0) return;
  const auto& v = truth.velocity_m_s;
  const Eigen::Vector4d error =
      Eigen::Vector4d(truth.position_m[1], truth.position_m[2] + floor_m_, v[1], v[2]) - filter_->state();
  nees_sum_ += error.dot(filter_->covariance().inverse() * error);
  ++nees_count_;
}

void Localisation::finish(FlightScore& score) const {
  score.nees = nees_count_ > 0 ? nees_sum_ / static_cast<double>(nees_count_) : 0;
  score.matches = matches_;
  score.rejected_matches = rejected_;
}

template FlightScore fly<Localisation>(const FlightSetup&, Localisation&, AnyController&, FlightLog*);

}  // namespace tunnelrig
