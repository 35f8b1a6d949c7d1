#include "flight/simulation/localisation.h"

#include "flight/simulation/flight_loop.h"

#include <Eigen/LU>

namespace tunnelrig {
namespace {

/// Two columns see upright and level walls only; a section with any other needs all directions.
HoughForm form_for(const Tunnel& tunnel) {
  if (tunnel.circle_diameter_m > 0) return HoughForm::circle;
  const auto corners = tunnel.section.vertices();
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const SectionPoint along = corners[(i + 1) % corners.size()] - corners[i];
    if (std::min(std::abs(along.x()), std::abs(along.y())) > 1e-6) return HoughForm::all_directions;
  }
  return HoughForm::two_columns;
}

MatcherSettings matcher_settings(const FlightSpace& space, const LidarSettings& lidar) {
  MatcherSettings settings;
  settings.layout = lidar.layout;
  settings.least_range_m = lidar.least_range_m;
  settings.most_range_m = lidar.most_range_m;
  settings.form = form_for(space.tunnel);
  settings.circle_diameter_m = space.tunnel.circle_diameter_m;
  return settings;
}

Attitude lidar_attitude(const EulerAngles& angles) {
  return {angles.roll_rad, angles.pitch_rad, angles.yaw_rad};
}

}  // namespace

Localisation::Localisation(const FlightSpace& space, const LocalisationSettings& settings,
                           const FlightSetup& setup)
    : settings_(settings),
      floor_m_(space.floor_m),
      lidar_(space.tunnel.section, settings.lidar, Random(setup.seed, 4 * setup.stream + 2).bits()),
      matcher_(space.tunnel.section, matcher_settings(space, settings.lidar)),
      filter_(Eigen::Vector2d::Zero(), settings.model) {}

SectionPoint Localisation::in_section(const RigidState& truth) const {
  return {truth.position_m[1], truth.position_m[2] + floor_m_};
}

LidarPose Localisation::pose(const EstimatorInput& in) const {
  return {in_section(*in.truth), lidar_attitude(euler_angles(in.truth->attitude))};
}

void Localisation::start(const RigidState& truth) {
  filter_ = AugmentedFilter(in_section(truth), settings_.model);
  pending_ = {};
  in_sweep_ = false;
  first_ = true;
  next_sweep_s_ = 1 / settings_.lidar.rate_hz;
}

void Localisation::scan(const EstimatorInput& in) {
  const Scan sweep = lidar_.sweep(sweep_start_, pose(in));
  const Match match = matcher_.match(sweep, lidar_attitude(in.attitude), filter_.position_m());
  ++matches_;
  if (!match.accepted) {
    ++rejected_;
    return;
  }
  // The beams were measured over the sweep: what they show is where the vehicle was at its middle.
  pending_ = {match.position_m, match.covariance_m2, in.time_s - 0.5 * settings_.lidar.sweep_s,
              in.time_s + settings_.latency_s, true};
}

PlanarEstimate Localisation::step(const EstimatorInput& in) {
  if (!first_) {
    AugmentedModel::Input input;
    input.modelled_m_s2 = Eigen::Vector2d(in.modelled_m_s2[0], in.modelled_m_s2[1]);
    input.measured_m_s2 = Eigen::Vector2d(in.acceleration_m_s2[0], in.acceleration_m_s2[1]);
    filter_.predict(input, kControlStep_s);
  }
  first_ = false;
  constexpr double kHalfStep_s = 0.5 * kControlStep_s;
  if (!in_sweep_ && in.time_s >= next_sweep_s_ - settings_.lidar.sweep_s - kHalfStep_s) {
    sweep_start_ = pose(in);
    in_sweep_ = true;
  }
  if (in_sweep_ && in.time_s >= next_sweep_s_ - kHalfStep_s) {
    scan(in);
    in_sweep_ = false;
    next_sweep_s_ += 1 / settings_.lidar.rate_hz;
  }
  if (pending_.waits && in.time_s >= pending_.due_s - kHalfStep_s) {
    if (!filter_.correct(pending_.position_m, pending_.covariance_m2, in.time_s - pending_.taken_s).accepted)
      ++rejected_;
    pending_.waits = false;
    const Eigen::Vector2d error = filter_.position_m() - in_section(*in.truth);
    const Eigen::Matrix2d covariance = filter_.covariance().topLeftCorner<2, 2>();
    nees_sum_ += error.dot(covariance.inverse() * error);
    ++nees_count_;
  }
  const Eigen::Vector2d p = filter_.position_m(), v = filter_.velocity_m_s();
  return {{p.x(), p.y() - floor_m_}, {v.x(), v.y()}};
}

void Localisation::finish(FlightScore& score) const {
  score.matches = matches_;
  score.rejected_matches = rejected_;
  score.nees = nees_count_ > 0 ? nees_sum_ / static_cast<double>(nees_count_) : 0;
}

template FlightScore fly<Localisation>(const FlightSetup&, Localisation&, AnyController&, FlightLog*);

}  // namespace tunnelrig
