// Compressibility steepens the lift slope as the tip nears the speed of sound.
#include "analysis/air.h"
#include "analysis/effects/effect.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tunnelrig::effects {
namespace {

double compressibility(std::span<const double> x, double radius_m) {
  const double tip_m_s = x[0] * 2 * std::numbers::pi / 60 * radius_m;
  const double mach = std::min(tip_m_s / speed_of_sound_m_s(x[1] + kZeroCelsius_K), 0.99);
  return 1 - mach * mach;
}

struct TipMach {
  template <class T>
  T operator()(const Sample& s, const T* p, const T& force) const {
    using std::pow;
    const double ratio =
        compressibility(s.x, s.radius_m) / compressibility(s.reference, s.rig->propeller_radius_m);
    return force * pow(T(ratio), -p[0]);
  }
};

}  // namespace

std::vector<Effect> tip_mach() {
  return {make_effect<TipMach>({
      .name = "tip_mach",
      .form = "",
      .formula = "F ((1 − M²) / (1 − M0²))^(−m), M = Ω R / a(Θ)",
      .physics = "Prandtl–Glauert: the lift slope goes with (1 − M²)^(−1/2); m would be 1/2 if the whole "
                 "blade saw the tip's Mach number",
      .parameters = {{"exponent", "1", 0, 2}},
      .covariates = {"speed_rpm", "air_temperature_C"},
      .scope = EffectScope::kShared,
      .needs_diameters = true,
      .sign_rule = "thrust grows with the tip Mach number",
      .force_N = {},
      .jet_N = {},
  })};
}

}  // namespace tunnelrig::effects
