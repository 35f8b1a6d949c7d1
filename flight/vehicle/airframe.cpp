#include "flight/vehicle/airframe.h"

#include "datasets/error.h"

#include <cmath>
#include <numbers>

namespace tunnelrig {
namespace {

void require(bool holds, const char* name, double value, const char* rule) {
  if (!holds || !std::isfinite(value)) throw InputError::in("vehicle", "{} = {:g}: {}", name, value, rule);
}

}  // namespace

double Airframe::thrust_per_speed2_N_s2() const {
  const double disc_m2 = std::numbers::pi * propeller_radius_m * propeller_radius_m;
  return 0.5 * air_density_kg_m3 * propeller_radius_m * propeller_radius_m * disc_m2 * c_t / kRotors;
}

double Airframe::largest_speed_rad_s() const {
  return std::sqrt(largest_thrust_N / thrust_per_speed2_N_s2());
}

void Airframe::validate() const {
  const double weight_N = mass_kg * kGravity_m_s2;
  require(mass_kg > 0, "mass_kg", mass_kg, "must be above 0");
  for (const double inertia : inertia_kg_m2)
    require(inertia > 0, "inertia_kg_m2", inertia, "must be above 0");
  require(height_m > 0, "height_m", height_m, "must be above 0");
  require(propeller_radius_m > 0, "propeller_radius_m", propeller_radius_m, "must be above 0");
  require(rotor_arm_m > 0, "rotor_arm_m", rotor_arm_m, "must be above 0");
  require(width_m >= 2 * rotor_offset_m(), "width_m", width_m, "must hold the rotor axes (rotor_arm_m · √2)");
  require(c_t > 0, "c_t", c_t, "must be above 0");
  require(air_density_kg_m3 > 0, "air_density_kg_m3", air_density_kg_m3, "must be above 0");
  require(kRotors * largest_thrust_N > weight_N, "largest_thrust_N", largest_thrust_N,
          "four of them must exceed the weight");
  require(smallest_thrust_N >= 0 && kRotors * smallest_thrust_N < weight_N, "smallest_thrust_N",
          smallest_thrust_N, "four of them must stay below the weight");
  require(motor_lag_s > 0, "motor_lag_s", motor_lag_s, "must be above 0");
}

}  // namespace tunnelrig
