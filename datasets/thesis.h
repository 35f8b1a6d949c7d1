// Numbers printed in "Control and Aerodynamic Analysis of Quadcopters in Confined Spaces", with their place
// in it.
#pragma once

namespace tunnelrig::thesis {

inline constexpr double kGasConstant_J_kgK = 287.058;  // λ of dry air, (4.17)
inline constexpr double kPressure_Pa = 101325;         // held constant, (4.17)

inline constexpr double kCtOpenSpace = 0.1056;     // Table 5.1, experiment
inline constexpr double kCtOpenSpaceStd = 3.5e-4;  // Section 4.2.2
inline constexpr double kCtTunnelOrigin = 0.1071;  // Table 5.1, experiment

inline constexpr double kCorrelationGate = 0.98;  // Section 4.2.1.1

}  // namespace tunnelrig::thesis
