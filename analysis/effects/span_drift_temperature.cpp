// The cell's sensitivity follows its temperature.
#include "analysis/effects/effect.h"

namespace tunnelrig::effects {
namespace {

struct SpanDriftTemperature {
  template <class T>
  T operator()(const Sample& s, const T* p, const T& force) const {
    return force * (1.0 + p[0] * (s.x[0] - s.reference[0]));
  }
};

}  // namespace

std::vector<Effect> span_drift_temperature() {
  return {
      make_effect<SpanDriftTemperature>({
          .name = "span_drift_temperature",
          .form = "cell",
          .formula = "F (1 + s (θ_cell − θ_cell0))",
          .physics = "temperature coefficient of the gauge factor and of the spring's modulus (OIML R 60)",
          .parameters = {{"coefficient", "1/K", -0.02, 0.02}},
          .covariates = {"cell_temperature_C"},
          .scope = EffectScope::kRotor,
          .sign_rule = "either",
          .force_N = {},
          .jet_N = {},
      }),
      make_effect<SpanDriftTemperature>({
          .name = "span_drift_temperature",
          .form = "air",
          .formula = "F (1 + s (θ_air − θ_air0))",
          .physics = "temperature coefficient of the gauge factor and of the spring's modulus (OIML R 60)",
          .parameters = {{"coefficient", "1/K", -0.02, 0.02}},
          .covariates = {"air_temperature_C"},
          .scope = EffectScope::kRotor,
          .origin = EffectOrigin::kCellInAir,
          .sign_rule = "either",
          .force_N = {},
          .jet_N = {},
      })};
}

}  // namespace tunnelrig::effects
