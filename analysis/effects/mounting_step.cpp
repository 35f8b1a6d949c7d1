// A rig that was knocked or bolted anew has another zero.
#include "analysis/effects/effect.h"

namespace tunnelrig::effects {
namespace {

struct MountingStep {
  template <class T>
  T operator()(const Sample& s, const T* p, const T& force) const {
    const bool after = !(s.x[0] < p[1]);
    const bool tared_after = !s.at_zero.empty() && !(s.at_zero[0] < p[1]);
    if (after == tared_after) return force;
    return force + p[0] * (after ? s.newtons_per_volt : -s.newtons_per_volt);
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
      .of_zero = true,
      .sign_rule = "either",
      .force_N = {},
      .jet_N = {},
  })};
}

}  // namespace tunnelrig::effects
