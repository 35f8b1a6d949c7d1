// What the simulated quadcopter is: masses, lengths, rotors, drag. The thesis's vehicle (3.2.2) as far as it
// is printed; what is not printed is marked "assumed".
//
// World frame (3.4): origin at the middle of the cross-section's lower edge, y right, z up, x out of the
// page, so that the three are right-handed and a positive roll accelerates to the left (3.5). Body frame: the
// same at rest.
#pragma once

#include <array>
#include <cstddef>
#include <string>

namespace tunnelrig {

inline constexpr double kGravity_m_s2 = 9.80665;
inline constexpr std::size_t kRotors = 4;

struct Airframe {
  double mass_kg = 2.3;
  std::array<double, 3> inertia_kg_m2 = {0.030, 0.030, 0.055};  // about x, y, z; assumed

  // The rig's lengths, which the map is made with; tip to tip, not the 715 mm without propellers.
  double width_m = 0.7434;
  double height_m = 0.3;
  double rotor_arm_m = 0.310;  // R_q, centre to rotor axis; the rotors stand at 45°
  double propeller_radius_m = 0.1524;

  double c_t = 0.1071;  // (4.18) with one disc as A, at OT
  double air_density_kg_m3 = 1.2;
  double largest_thrust_N = 1.6 * kGravity_m_s2;  // of one rotor
  double smallest_thrust_N = 0.3;                 // idle; assumed
  double motor_lag_s = 0.04;                      // first order, in speed; assumed
  double torque_over_thrust_m = 0.016;            // assumed

  std::array<double, 2> linear_drag_N_s_m = {0.25, 1.1};  // across and along the rotor axes; assumed
  double quadratic_drag_N_s2_m2 = 0.018;                  // 0.5 ρ C_d A with C_d A = 0.03 m²; assumed
  std::array<double, 3> rate_damping_N_m_s = {0.05, 0.05, 0.01};  // assumed
  double airspeed_gain_s2_m2 = 0.004;  // thrust · (1 + gain V²) in edgewise flow, after Glauert; assumed

  /// Distance of a rotor's axis from the body's x-z or y-z plane.
  double rotor_offset_m() const { return rotor_arm_m * 0.70710678118654752; }

  /// T = k Ω² of one rotor, from (4.18): C_T is the sum of all four over 0.5 ρ Ω² R² A of one disc.
  double thrust_per_speed2_N_s2() const;

  double largest_speed_rad_s() const;

  /// Throws InputError naming the value and the rule that it breaks.
  void validate() const;
};

/// Rotors 1 to 4 as the rig's (docs/campaign-folder.md): 1 front right, 2 rear left, 3 front left, 4 rear
/// right. The front is away from the viewer, at negative x. The sign of the moment about z: 1 and 2 turn
/// counter-clockwise.
inline constexpr std::array<double, kRotors> kRotorX = {-1, 1, -1, 1};
inline constexpr std::array<double, kRotors> kRotorY = {1, -1, -1, 1};
inline constexpr std::array<double, kRotors> kRotorSpin = {-1, -1, 1, 1};

}  // namespace tunnelrig
