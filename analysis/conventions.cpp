#include "analysis/conventions.h"

#include "datasets/error.h"

#include <array>
#include <cmath>
#include <numbers>

namespace tunnelrig {
namespace {

constexpr std::array<std::string_view, 3> kNames = {"thesis", "helicopter", "propeller"};

/// How much larger a coefficient of this convention is than the thesis's, for the same thrust.
double per_thesis(Convention convention, const Rig& rig) {
  const double disc = std::numbers::pi * rig.propeller_radius_m * rig.propeller_radius_m;
  // T/(ρ A_disc Ω²R²) of one rotor of ΣT = C ½ ρ Ω² R² A
  const double helicopter = 0.5 * rig.rotor_area_m2 / disc / rig.rotors;
  switch (convention) {
    case Convention::kThesis:
      return 1;
    case Convention::kHelicopter:
      return helicopter;
    // ρ n² D⁴ = ρ (Ω/2π)² 16 R⁴ = (4/π³) ρ A_disc Ω² R²
    case Convention::kPropeller:
      return helicopter * std::numbers::pi * std::numbers::pi * std::numbers::pi / 4;
  }
  return 1;
}

}  // namespace

Convention convention_from_name(std::string_view name) {
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    if (kNames[i] == name) return static_cast<Convention>(i);
  }
  throw InputError(fmt::format("'{}' is no convention; write thesis, helicopter or propeller", name));
}

std::string_view name_of(Convention convention) { return kNames[static_cast<std::size_t>(convention)]; }

double convert_coefficient(double value, Convention from, Convention to, const Rig& rig) {
  return value / per_thesis(from, rig) * per_thesis(to, rig);
}

std::string area_in_words(const Rig& rig) {
  const double disc = std::numbers::pi * rig.propeller_radius_m * rig.propeller_radius_m;
  constexpr double kAlike = 1e-3;
  return std::abs(rig.rotor_area_m2 / disc - 1) <= kAlike
             ? "one propeller disc"
             : fmt::format("an area of {:.4g} m²", rig.rotor_area_m2);
}

double angular_speed_rad_s(double speed_rpm) { return speed_rpm * std::numbers::pi / 30; }

double thesis_reference_thrust_N(double density_kg_m3, double speed_rpm, const Rig& rig) {
  const double omega = angular_speed_rad_s(speed_rpm);
  return 0.5 * density_kg_m3 * omega * omega * rig.propeller_radius_m * rig.propeller_radius_m *
         rig.rotor_area_m2;
}

double propeller_coefficient(double thrust_N, double density_kg_m3, double speed_rpm, double diameter_m) {
  const double n = speed_rpm / 60;
  return thrust_N / (density_kg_m3 * n * n * diameter_m * diameter_m * diameter_m * diameter_m);
}

}  // namespace tunnelrig
