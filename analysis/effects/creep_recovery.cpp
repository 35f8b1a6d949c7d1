// A spring relieved of a larger load recovers slowly.
#include "analysis/effects/effect.h"

#include <cmath>

namespace tunnelrig::effects {
namespace {

struct CreepRecovery {
  template <class T>
  T operator()(const Sample& s, const T* p, const T& force) const {
    using std::exp;
    if (std::isnan(s.previous_N)) return force;
    return force + p[0] * (s.previous_N - force) * exp(-(s.x[0] + s.time_s) / p[1]);
  }
};

}  // namespace

std::vector<Effect> creep_recovery() {
  return {make_effect<CreepRecovery>({
      .name = "creep_recovery",
      .form = "",
      .formula = "F + c (F_prev − F) e^(−t/τ)",
      .physics = "anelasticity: the load before is remembered (OIML R 60, return)",
      .parameters = {{"amplitude", "1", 0, 0.5},
                     {"time_constant", "s", 0.5, 7200, ParameterRole::kShape, time_constants_s(), {}}},
      .covariates = {"time_since_motor_start_s"},
      .scope = EffectScope::kRotor,
      .needs_previous = true,
      .sign_rule = "the reading remembers the load before",
      .force_N = {},
      .jet_N = {},
  })};
}

}  // namespace tunnelrig::effects
