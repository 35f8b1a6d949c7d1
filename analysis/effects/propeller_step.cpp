// A propeller that was changed or chipped has another coefficient.
#include "analysis/effects/effect.h"

namespace tunnelrig::effects {
namespace {

struct PropellerStep {
  template <class T>
  T operator()(const Sample& s, const T* p, const T& force) const {
    return s.x[0] < p[1] ? force : force * (1.0 + p[0]);
  }
};

}  // namespace

std::vector<Effect> propeller_step() {
  return {make_effect<PropellerStep>({
      .name = "propeller_step",
      .form = "",
      .formula = "F (1 + s) from one run on",
      .physics = "propellers differ by 1 to 3 % (thesis, section 4.4)",
      .parameters = {{"step", "1", -0.2, 0.2},
                     {"first_run", "run", 0, 1e9, ParameterRole::kChangePoint, {}, {}}},
      .covariates = {"run_order"},
      .scope = EffectScope::kRotor,
      .sign_rule = "either",
      .force_N = {},
      .jet_N = {},
  })};
}

}  // namespace tunnelrig::effects
