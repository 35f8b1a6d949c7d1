#include "flight/simulation/residual_recorder.h"

namespace tunnelrig {
namespace {

constexpr int kCyclesPerRow = 200;
// The rotors' unsteadiness lasts for a third of a second: rows that follow at once would not be independent.
constexpr int kCyclesBetweenRows = 400;
constexpr double kSettled_s = 2;  // a path may begin with a jump of velocity

}  // namespace

ResidualRecorder::ResidualRecorder(const FlightSetup& setup, FlightLog* log)
    : setup_(setup), log_(log), motors_(setup.believed, kControlStep_s) {
  if (log_ == nullptr) return;
  log_->reserve(setup.trajectory->duration_s());
  motors_.settle(setup.believed.mass_kg * kGravity_m_s2 / kRotors);
}

/// (3.2) and (3.3) for the believed vehicle in the measured field, with what is known of drag, over the cycle
/// to come.
void ResidualRecorder::predict(const ControlInput& in, const PerRotor& thrust_N, const AttitudeSense& sense) {
  const Airframe& frame = setup_.believed;
  motors_.command(thrust_N);
  const StepLoads step = motors_.advance({1, 1, 1, 1});
  const RotorLoads& mean = step[1];
  ResidualRow& p = predicted_;
  p.y_norm = setup_.scale.y_norm(in.position_m[0]);
  p.z_norm = setup_.scale.z_norm(in.position_m[1]);
  const Disturbance walls = setup_.map != nullptr ? setup_.map->at(p.y_norm, p.z_norm) : Disturbance{};
  p.thrust_m_s2 = mean.thrust_N / frame.mass_kg;
  for (std::size_t i = 0; i < kRotors; ++i)
    p.rotor_thrust_N[i] =
        motors_.thrust_per_speed2_N_s2() * motors_.speed_rad_s()[i] * motors_.speed_rad_s()[i];
  const double right_N = p.rotor_thrust_N[0] + p.rotor_thrust_N[3],
               left_N = p.rotor_thrust_N[1] + p.rotor_thrust_N[2];
  const double added_right_N = right_N * (walls.right_factor() - 1),
               added_left_N = left_N * (walls.left_factor() - 1);
  p.map_thrust_m_s2 = (added_right_N + added_left_N) / frame.mass_kg;
  p.map_roll_rad_s2 = frame.rotor_offset_m() * (added_right_N - added_left_N) / frame.inertia_kg_m2[0];
  const auto& [vy, vz] = in.velocity_m_s;
  const double across = frame.linear_drag_N_s_m[0] / frame.mass_kg,
               along = frame.linear_drag_N_s_m[1] / frame.mass_kg;
  const double axial =
      p.thrust_m_s2 + p.map_thrust_m_s2 - (along - across) * (vz * in.cos_tilt - vy * in.sin_roll);
  p.residual_m_s2 = {-axial * in.sin_roll - across * vy, axial * in.cos_tilt - kGravity_m_s2 - across * vz};
  p.roll_residual_rad_s2 =
      (mean.moment_N_m[0] - frame.rate_damping_N_m_s[0] * sense.rate_rad_s[0]) / frame.inertia_kg_m2[0] +
      p.map_roll_rad_s2;
  p.pitch_residual_rad_s2 =
      (mean.moment_N_m[1] - frame.rate_damping_N_m_s[1] * sense.rate_rad_s[1]) / frame.inertia_kg_m2[1];
}

void ResidualRecorder::cycle(long cycle, const ControlInput& in, const ControlOutput& out,
                             double roll_target_rad, const PerRotor& thrust_N, const RigidState& truth,
                             const AttitudeSense& sense, double airspeed_m_s) {
  const double time_s = static_cast<double>(cycle) * kControlStep_s;
  if (cycle % log_->every == 0) {
    log_->rows.push_back({time_s,
                          in.reference.position_m,
                          {truth.position_m[1], truth.position_m[2]},
                          in.position_m,
                          {truth.velocity_m_s[1], truth.velocity_m_s[2]},
                          sense.angles.roll_rad,
                          roll_target_rad,
                          out.thrust_m_s2,
                          truth.position_m[0]});
  }
  // Another phase of the path in every flight
  const long turn = (cycle + 137 * static_cast<long>(setup_.stream)) % (kCyclesPerRow + kCyclesBetweenRows);
  const bool resting =
      time_s < kSettled_s || turn < kCyclesBetweenRows || (in_sum_ == 0 && turn > kCyclesBetweenRows);
  if (has_prediction_ && !resting) {  // the measurement is of the cycle that has gone by
    const ResidualRow& p = predicted_;
    const auto add = [](double& sum, double value) { sum += value / kCyclesPerRow; };
    add(sum_.y_norm, p.y_norm);
    add(sum_.z_norm, p.z_norm);
    for (std::size_t i = 0; i < 2; ++i)
      add(sum_.residual_m_s2[i], in.acceleration_m_s2[i] - p.residual_m_s2[i]);
    add(sum_.roll_residual_rad_s2,
        (sense.rate_rad_s[0] - earlier_rate_[0]) * kControlRate_Hz - p.roll_residual_rad_s2);
    add(sum_.pitch_residual_rad_s2,
        (sense.rate_rad_s[1] - earlier_rate_[1]) * kControlRate_Hz - p.pitch_residual_rad_s2);
    add(sum_.thrust_m_s2, p.thrust_m_s2);
    add(sum_.map_thrust_m_s2, p.map_thrust_m_s2);
    add(sum_.map_roll_rad_s2, p.map_roll_rad_s2);
    add(sum_.airspeed_m_s, airspeed_m_s);
    for (std::size_t i = 0; i < kRotors; ++i) add(sum_.rotor_thrust_N[i], p.rotor_thrust_N[i]);
    if (++in_sum_ == kCyclesPerRow) {
      sum_.time_s = time_s;
      log_->residuals.push_back(sum_);
      sum_ = {};
      in_sum_ = 0;
    }
  }
  earlier_rate_ = {sense.rate_rad_s[0], sense.rate_rad_s[1]};
  predict(in, thrust_N, sense);
  has_prediction_ = true;
}

}  // namespace tunnelrig
