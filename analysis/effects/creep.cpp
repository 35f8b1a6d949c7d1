// A loaded spring goes on yielding.
#include "analysis/effects/effect.h"

#include <cmath>

namespace tunnelrig::effects {
namespace {

struct Creep {
  template <class T>
  T operator()(const Sample& s, const T* p, const T& force) const {
    using std::exp;
    return force * (1.0 + p[0] * (1.0 - exp(-(s.x[0] + s.time_s) / p[1])));
  }
};

}  // namespace

std::vector<Effect> creep() {
  return {make_effect<Creep>({
      .name = "creep",
      .form = "",
      .formula = "F (1 + c (1 − e^(−t/τ))), t since the load",
      .physics = "anelasticity of spring and adhesive (OIML R 60, creep)",
      .parameters = {{"amplitude", "1", 0, 0.5},
                     {"time_constant", "s", 0.5, 7200, ParameterRole::kShape, time_constants_s(), {}}},
      .covariates = {"time_since_motor_start_s"},
      .scope = EffectScope::kRotor,
      .sign_rule = "the reading grows under load",
      .force_N = {},
      .jet_N = {},
  })};
}

}  // namespace tunnelrig::effects
