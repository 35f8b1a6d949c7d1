// The bridge has an offset that follows its temperature.
#include "analysis/effects/effect.h"

namespace tunnelrig::effects {
namespace {

struct ZeroDriftTemperature {
  template <class T>
  T operator()(const Sample& s, const T* p, const T& force) const {
    return force + p[0] * (s.newtons_per_volt * since_zero(s, 0, s.reference[0]));
  }
};

}  // namespace

std::vector<Effect> zero_drift_temperature() {
  return {make_effect<ZeroDriftTemperature>({
              .name = "zero_drift_temperature",
              .form = "cell",
              .formula = "F + g z (θ_cell − θ_cell0), g in N/V",
              .physics = "temperature coefficient of the bridge zero (OIML R 60)",
              .parameters = {{"coefficient", "V/K", -0.05, 0.05}},
              .covariates = {"cell_temperature_C"},
              .scope = EffectScope::kRotor,
              .additive = true,
              .of_zero = true,
              .sign_rule = "either",
              .force_N = {},
              .jet_N = {},
          }),
          make_effect<ZeroDriftTemperature>({
              .name = "zero_drift_temperature",
              .form = "air",
              .formula = "F + g z (θ_air − θ_air0), g in N/V",
              .physics = "temperature coefficient of the bridge zero (OIML R 60)",
              .parameters = {{"coefficient", "V/K", -0.05, 0.05}},
              .covariates = {"air_temperature_C"},
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
