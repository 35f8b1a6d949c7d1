// Hum of the mains is rectified by the amplifier.
#include "analysis/effects/effect.h"

namespace tunnelrig::effects {
namespace {

struct MainsPickup {
  template <class T>
  T operator()(const Sample& s, const T* p, const T& force) const {
    return force + p[0] * (s.newtons_per_volt * since_zero(s, 0, 0));
  }
};

}  // namespace

std::vector<Effect> mains_pickup() {
  return {make_effect<MainsPickup>({
      .name = "mains_pickup",
      .form = "",
      .formula = "F + g m A_mains",
      .physics =
          "rectification of the hum by the amplifier; A is the amplitude of the mains lines in the spectrum",
      .parameters = {{"coefficient", "1", -5, 5}},
      .covariates = {"mains_amplitude_V"},
      .scope = EffectScope::kRotor,
      .additive = true,
      .of_zero = true,
      .sign_rule = "either",
      .force_N = {},
      .jet_N = {},
  })};
}

}  // namespace tunnelrig::effects
