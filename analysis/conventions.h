// The thrust coefficients of the field, and how they turn into each other.
#pragma once

#include "datasets/campaign.h"

#include <string>
#include <string_view>

namespace tunnelrig {

enum class Convention {
  kThesis,      // ΣT / (½ ρ Ω² R² A), A one propeller disc (4.18)
  kHelicopter,  // T / (ρ A (ΩR)²) of one rotor (Leishman, Principles of Helicopter Aerodynamics, 2.19)
  kPropeller,   // T / (ρ n² D⁴) of one rotor (UIUC, RCbenchmark)
};

/// "thesis", "helicopter" or "propeller"; throws InputError.
Convention convention_from_name(std::string_view name);
std::string_view name_of(Convention convention);

/// Converts a coefficient of the whole rig between conventions. Where a convention is per rotor, it is the
/// mean of the rotors.
double convert_coefficient(double value, Convention from, Convention to, const Rig& rig);

/// A of the thesis's coefficient, for captions: "one propeller disc" where it is that to 0.1 %, as areas are
/// written, else "an area of 0.0365 m²".
std::string area_in_words(const Rig& rig);

/// ½ ρ Ω² R² A, what a thrust is divided by for the thesis's coefficient, N.
double thesis_reference_thrust_N(double density_kg_m3, double speed_rpm, const Rig& rig);

/// T / (ρ n² D⁴) of one rotor.
double propeller_coefficient(double thrust_N, double density_kg_m3, double speed_rpm, double diameter_m);

double angular_speed_rad_s(double speed_rpm);

}  // namespace tunnelrig
