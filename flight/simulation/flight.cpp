#include "flight/simulation/flight_loop.h"

namespace tunnelrig {

SimulatedVehicle::SimulatedVehicle(const FlightSetup& setup)
    : setup_(setup),
      body_(setup.vehicle),
      motors_(setup.vehicle, kPhysicsStep_s),
      air_(setup.seed, 4 * setup.stream),
      gust_(setup.air.gust_m_s, setup.air.gust_time_s, kControlStep_s),
      right_(setup.air.thrust_unsteadiness, setup.air.unsteadiness_time_s, kControlStep_s),
      left_(setup.air.thrust_unsteadiness, setup.air.unsteadiness_time_s, kControlStep_s),
      reach_m_(0.5 * std::hypot(setup.vehicle.width_m, setup.vehicle.height_m)) {
  const Plane start = setup.trajectory->at(0).position_m;
  state_.position_m = {0, start[0], start[1]};
  motors_.settle(setup.vehicle.mass_kg * kGravity_m_s2 / kRotors);
}

PerRotor SimulatedVehicle::rotor_factors(FlightScore& score) {
  wind_m_s_ = setup_.air.wind_m_s + gust_.advance(air_);
  const double airspeed = airspeed_m_s();
  const double edgewise = 1 + setup_.vehicle.airspeed_gain_s2_m2 * airspeed * airspeed;
  const double right_unsteady = right_.advance(air_), left_unsteady = left_.advance(air_);
  Disturbance walls;
  if (setup_.field != nullptr) {
    const double y = setup_.scale.y_norm(state_.position_m[1]), z = setup_.scale.z_norm(state_.position_m[2]);
    walls = setup_.field->at(y, z);
    if (DisturbanceField::outside(y, z)) score.clamped_s += kControlStep_s;
  }
  const double right = (walls.right_factor() + right_unsteady) * edgewise;
  const double left = (walls.left_factor() + left_unsteady) * edgewise;
  const PerRotor& own = setup_.rotor_scale;
  return {own[0] * right, own[1] * left, own[2] * left, own[3] * right};
}

void SimulatedVehicle::advance(const PerRotor& thrust_N, double time_s, FlightScore& score) {
  if (motors_.command(thrust_N)) score.saturated_s += kControlStep_s;
  const PerRotor factors = rotor_factors(score);
  for (int i = 0; i < kStepsPerCycle; ++i)
    rk4_step(state_, body_, motors_.advance(factors), wind_m_s_, kPhysicsStep_s);
  if (setup_.walls == nullptr) return;
  // Never further than this in one cycle: speeds change by less than 10 % in it, blows apart, after which it
  // looks again.
  free_way_m_ -= 1.1 * kControlStep_s * (std::abs(state_.velocity_m_s[1]) + std::abs(state_.velocity_m_s[2]));
  if (free_way_m_ <= 1e-3) meet_walls(time_s + kControlStep_s, score);
}

void SimulatedVehicle::meet_walls(double time_s, FlightScore& score) {
  const Point centre = {state_.position_m[1], state_.position_m[2]};
  free_way_m_ = setup_.walls->inside(centre) ? setup_.walls->distance(centre) - reach_m_ : 0;
  if (free_way_m_ > 0) return;
  const std::array<double, 3> up = thrust_axis(state_.attitude);
  const double cos_roll = up[2] / std::hypot(up[1], up[2]), sin_roll = -up[1] / std::hypot(up[1], up[2]);
  const Touch touch = find_touch(*setup_.walls, setup_.vehicle, centre[0], centre[1], sin_roll, cos_roll);
  if (touch.depth_m <= 0) return;
  const double speed = resolve_touch(state_, setup_.vehicle, touch, setup_.bounce);
  // What rubs along a wall is one contact until it has been off the wall for a tenth of a second.
  constexpr double kApart_s = 0.1;
  const bool is_new = last_touch_s_ < 0 || time_s - last_touch_s_ > kApart_s;
  last_touch_s_ = time_s;
  if (!is_new) return;
  ++score.contact_count;
  constexpr std::size_t kMostKept = 64;
  if (score.contacts.size() < kMostKept)
    score.contacts.push_back({time_s, centre[0], centre[1], touch.at[0], touch.at[1], speed});
}

ControllerContext controller_context(const FlightSetup& setup) {
  const Airframe& frame = setup.believed;
  return {.mass_kg = frame.mass_kg,
          .rotor_offset_m = frame.rotor_offset_m(),
          .full_thrust_m_s2 = kRotors * frame.largest_thrust_N / frame.mass_kg,
          .map = setup.map,
          .scale = setup.scale};
}

template FlightScore fly<GivenPosition>(const FlightSetup&, GivenPosition&, AnyController&, FlightLog*);

}  // namespace tunnelrig
