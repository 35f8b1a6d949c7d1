// A converter at its end cuts off peaks.
#include "analysis/effects/effect.h"

namespace tunnelrig::effects {
namespace {

struct AdcClipping {
  template <class T>
  T operator()(const Sample& s, const T* p, const T& force) const {
    return force * (1.0 - p[0] * s.x[0]);
  }
};

}  // namespace

std::vector<Effect> adc_clipping() {
  return {make_effect<AdcClipping>({
      .name = "adc_clipping",
      .form = "",
      .formula = "F (1 − c n_clipped / n)",
      .physics = "the mean of a clipped signal is pulled inwards",
      .parameters = {{"coefficient", "1", 0, 20}},
      .covariates = {"clip_fraction"},
      .scope = EffectScope::kRotor,
      .sign_rule = "clipping lowers the mean",
      .force_N = {},
      .jet_N = {},
  })};
}

}  // namespace tunnelrig::effects
