// A speed controller in open loop lets the speed follow the supply.
#include "analysis/effects/effect.h"

#include <cmath>

namespace tunnelrig::effects {
namespace {

struct SupplyVoltage {
  template <class T>
  T operator()(const Sample& s, const T* p, const T& force) const {
    using std::pow;
    return force * pow(T(s.x[0] / s.reference[0]), p[0]);
  }
};

}  // namespace

std::vector<Effect> supply_voltage() {
  return {make_effect<SupplyVoltage>({
      .name = "supply_voltage",
      .form = "",
      .formula = "F (V / V0)^n",
      .physics = "speed at a fixed duty cycle follows the supply, n up to 2 (DC motor equation)",
      .parameters = {{"exponent", "1", 0, 4}},
      .covariates = {"supply_voltage_V"},
      .scope = EffectScope::kShared,
      .origin = EffectOrigin::kSupply,
      .sign_rule = "thrust grows with voltage",
      .force_N = {},
      .jet_N = {},
  })};
}

}  // namespace tunnelrig::effects
