// The motors do not turn at the nominal speed that the baseline takes.
#include "analysis/effects/effect.h"

#include <cmath>

namespace tunnelrig::effects {
namespace {

struct RotorSpeed {
  template <class T>
  T operator()(const Sample& s, const T* p, const T& force) const {
    using std::pow;
    return force * pow(T(s.x[0] / s.rig->nominal_speed_rpm), p[0]);
  }
};

}  // namespace

std::vector<Effect> rotor_speed() {
  return {make_effect<RotorSpeed>({
      .name = "rotor_speed",
      .form = "",
      .formula = "F (Ω / Ω_nominal)²",
      .physics = "thrust at constant C_T is proportional to Ω² (blade-element theory)",
      .parameters = {{"exponent", "1", 0, 4, ParameterRole::kAmplitude, {}, 2.0}},
      .covariates = {"speed_rpm"},
      .scope = EffectScope::kShared,
      .origin = EffectOrigin::kSpeedSquared,
      .theory_only = true,
      .sign_rule = "thrust grows with speed",
      .force_N = {},
      .jet_N = {},
  })};
}

}  // namespace tunnelrig::effects
