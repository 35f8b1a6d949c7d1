// A bridge's output is proportional to what feeds it.
#include "analysis/effects/effect.h"

#include <cmath>

namespace tunnelrig::effects {
namespace {

struct ExcitationVoltage {
  template <class T>
  T operator()(const Sample& s, const T* p, const T& force) const {
    using std::pow;
    return force * pow(T(s.x[0] / s.reference[0]), p[0]);
  }
};

}  // namespace

std::vector<Effect> excitation_voltage() {
  return {make_effect<ExcitationVoltage>({
      .name = "excitation_voltage",
      .form = "",
      .formula = "F (E / E0)^n",
      .physics = "bridge equation, n = 1",
      .parameters = {{"exponent", "1", 0, 3, ParameterRole::kAmplitude, {}, 1.0}},
      .covariates = {"excitation_voltage_V"},
      .scope = EffectScope::kShared,
      .of_reading = true,
      .sign_rule = "output grows with excitation",
      .force_N = {},
      .jet_N = {},
  })};
}

}  // namespace tunnelrig::effects
