// A cable pulls on the frame.
#include "analysis/effects/effect.h"

namespace tunnelrig::effects {
namespace {

struct CableForce {
  template <class T>
  T operator()(const Sample& s, const T* p, const T& force) const {
    return force + p[0] * since_zero(s, 0, 0);
  }
};

}  // namespace

std::vector<Effect> cable_force() {
  return {make_effect<CableForce>({
      .name = "cable_force",
      .form = "",
      .formula = "F + c f_cable",
      .physics = "the share of the measured cable force that the cell carries",
      .parameters = {{"share", "1", -2, 2}},
      .covariates = {"cable_force_N"},
      .scope = EffectScope::kRotor,
      .additive = true,
      .of_zero = true,
      .sign_rule = "either",
      .force_N = {},
      .jet_N = {},
  })};
}

}  // namespace tunnelrig::effects
