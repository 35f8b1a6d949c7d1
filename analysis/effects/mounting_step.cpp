// A rig that was knocked or bolted anew has another zero.
#include "analysis/effects/effect.h"

namespace tunnelrig::effects {
namespace {

struct MountingStep {
  template <class T>
  T operator()(const Sample& s, const T* p, const T& force) const {
    return s.x[0] < p[1] ? force : force + p[0] * s.newtons_per_volt;
  }
};

}  // namespace

std::vector<Effect> mounting_step() {
  return {make_effect<MountingStep>({
      .name = "mounting_step",
      .form = "",
      .formula = "F + g s from one run on",
      .physics = "change of the bridge's zero by its bolts",
      .parameters = {{"step", "V", -2, 2}, {"first_run", "run", 0, 1e9, ParameterRole::kChangePoint, {}, {}}},
      .covariates = {"run_order"},
      .scope = EffectScope::kRotor,
      .additive = true,
      .sign_rule = "either",
      .force_N = {},
      .jet_N = {},
  })};
}

}  // namespace tunnelrig::effects
