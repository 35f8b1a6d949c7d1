// A cell reads differently on the way up and on the way down.
#include "analysis/effects/effect.h"

#include <cmath>
#include <numbers>

namespace tunnelrig::effects {
namespace {

double value_of(double force) { return force; }
double value_of(const EffectJet& force) { return force.a; }

/// The sign of a difference, or what it is on average where the difference has an error: with the sign of the
/// error's making h would come out too small.
double expected_sign(double difference, double error) {
  if (error > 0) return std::erf(difference / (std::numbers::sqrt2 * error));
  return difference > 0 ? 1 : difference < 0 ? -1 : 0;
}

struct Hysteresis {
  template <class T>
  T operator()(const Sample& s, const T* p, const T& force) const {
    if (std::isnan(s.previous_N)) return force;
    return force * (1.0 + p[0] * expected_sign(s.previous_N - value_of(force), s.previous_error_N));
  }
};

}  // namespace

std::vector<Effect> hysteresis() {
  return {make_effect<Hysteresis>({
      .name = "hysteresis",
      .form = "",
      .formula = "F (1 + h sign(F_prev − F))",
      .physics = "friction within the spring; F_prev is the predicted force of the run before",
      .parameters = {{"coefficient", "1", -0.1, 0.1}},
      .covariates = {},
      .scope = EffectScope::kRotor,
      .needs_previous = true,
      .sign_rule = "either",
      .force_N = {},
      .jet_N = {},
  })};
}

}  // namespace tunnelrig::effects
