// Blades twist under load.
#include "analysis/effects/effect.h"

namespace tunnelrig::effects {
namespace {

struct BladeFlex {
  template <class T>
  T operator()(const Sample& s, const T* p, const T& force) const {
    const double ratio = s.x[0] / s.reference[0];
    return force * (1.0 + p[0] * (ratio * ratio - 1.0));
  }
};

}  // namespace

std::vector<Effect> blade_flex() {
  return {make_effect<BladeFlex>({
      .name = "blade_flex",
      .form = "",
      .formula = "F (1 + f ((Ω/Ω0)² − 1))",
      .physics = "twist, and with it C_T, goes with the dynamic pressure at the blade",
      .parameters = {{"coefficient", "1", -0.5, 0.5}},
      .covariates = {"speed_rpm"},
      .scope = EffectScope::kRotor,
      .rare = true,
      .sign_rule = "either",
      .force_N = {},
      .jet_N = {},
  })};
}

}  // namespace tunnelrig::effects
