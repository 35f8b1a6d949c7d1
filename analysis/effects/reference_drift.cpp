// A converter measures against its reference.
#include "analysis/effects/effect.h"

#include <cmath>

namespace tunnelrig::effects {
namespace {

struct ReferenceDrift {
  template <class T>
  T operator()(const Sample& s, const T* p, const T& force) const {
    using std::pow;
    return force * pow(T(s.x[0] / s.reference[0]), -p[0]);
  }
};

}  // namespace

std::vector<Effect> reference_drift() {
  return {make_effect<ReferenceDrift>({
      .name = "reference_drift",
      .form = "",
      .formula = "F (Vref / Vref0)^(−n)",
      .physics = "counts go with the inverse of the reference, n = 1",
      .parameters = {{"exponent", "1", 0, 3, ParameterRole::kAmplitude, {}, 1.0}},
      .covariates = {"adc_reference_V"},
      .scope = EffectScope::kShared,
      .of_reading = true,
      .sign_rule = "reading falls as the reference rises",
      .force_N = {},
      .jet_N = {},
  })};
}

}  // namespace tunnelrig::effects
