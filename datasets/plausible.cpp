#include "datasets/plausible.h"

#include <cmath>
#include <numbers>

namespace tunnelrig {

double most_rotor_thrust_N(const Rig& rig, double speed_rpm) {
  constexpr double kSeaLevel_kg_m3 = 1.2;
  const double tip_m_s = speed_rpm * std::numbers::pi / 30 * rig.propeller_radius_m;
  const double disc_m2 = std::numbers::pi * rig.propeller_radius_m * rig.propeller_radius_m;
  return kMostRotorCoefficient * 0.5 * kSeaLevel_kg_m3 * tip_m_s * tip_m_s * disc_m2;
}

bool beyond_converter(const Daq& daq, double volts) {
  constexpr double kRounding = 1.01;
  return std::abs(volts) > kRounding * daq.adc_reference_V;
}

}  // namespace tunnelrig
