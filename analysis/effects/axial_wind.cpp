// Wind along the tunnel changes the inflow of the rotors.
#include "analysis/effects/effect.h"

namespace tunnelrig::effects {
namespace {

struct AxialWind {
  template <class T>
  T operator()(const Sample& s, const T* p, const T& force) const {
    return force * (1.0 + p[0] * (s.x[0] * s.x[0]));
  }
};

}  // namespace

std::vector<Effect> axial_wind() {
  return {make_effect<AxialWind>({
      .name = "axial_wind",
      .form = "",
      .formula = "F (1 + w v²)",
      .physics = "edgewise flow changes induced velocity to second order in v (Glauert)",
      .parameters = {{"coefficient", "s2/m2", -0.1, 0.1}},
      .covariates = {"tunnel_airspeed_m_s"},
      .scope = EffectScope::kShared,
      .origin = EffectOrigin::kWind,
      .sign_rule = "either",
      .force_N = {},
      .jet_N = {},
  })};
}

}  // namespace tunnelrig::effects
