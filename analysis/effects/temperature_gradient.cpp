// A cell that is warmer than the air is warm at one end only.
#include "analysis/effects/effect.h"

namespace tunnelrig::effects {
namespace {

struct TemperatureGradient {
  template <class T>
  T operator()(const Sample& s, const T* p, const T& force) const {
    return force + p[0] * (s.newtons_per_volt * (since_zero(s, 0, 0) - since_zero(s, 1, 0)));
  }
};

}  // namespace

std::vector<Effect> temperature_gradient() {
  return {make_effect<TemperatureGradient>({
      .name = "temperature_gradient",
      .form = "",
      .formula = "F + g z (θ_cell − θ_air)",
      .physics = "thermal gradient across the bridge unbalances it",
      .parameters = {{"coefficient", "V/K", -0.05, 0.05}},
      .covariates = {"cell_temperature_C", "air_temperature_C"},
      .scope = EffectScope::kRotor,
      .origin = EffectOrigin::kCellInAir,
      .additive = true,
      .of_zero = true,
      .sign_rule = "either",
      .force_N = {},
      .jet_N = {},
  })};
}

}  // namespace tunnelrig::effects
