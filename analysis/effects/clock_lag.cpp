// Conditions were written down at another time than the thrust.
#include "analysis/air.h"
#include "analysis/effects/effect.h"

namespace tunnelrig::effects {
namespace {

struct ClockLag {
  template <class T>
  T operator()(const Sample& s, const T* p, const T& force) const {
    return force * (1.0 - p[0] * s.x[0] / (s.x[1] + kZeroCelsius_K));
  }
};

}  // namespace

std::vector<Effect> clock_lag() {
  return {make_effect<ClockLag>({
      .name = "clock_lag",
      .form = "",
      .formula = "F (1 − l (dΘ/dt) / Θ)",
      .physics = "a lag l of the thermometer's clock shifts the density along its trend",
      .parameters = {{"lag", "s", -900, 900}},
      .covariates = {"air_temperature_rate_K_s", "air_temperature_C"},
      .scope = EffectScope::kShared,
      .sign_rule = "either",
      .force_N = {},
      .jet_N = {},
  })};
}

}  // namespace tunnelrig::effects
