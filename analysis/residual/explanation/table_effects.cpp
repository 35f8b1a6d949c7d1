// Candidates that are as they are because of the table.
#include "analysis/effects/effect.h"
#include "analysis/residual/explanation/explanation.h"

#include <algorithm>
#include <optional>

namespace tunnelrig {
namespace {

/// F + x F_other, the other axis being a column of the table.
struct OtherAxis {
  template <class T>
  T operator()(const Sample& s, const T* p, const T& force) const {
    return force + p[0] * s.x[0];
  }
};

std::string as_divisor(const std::string& unit) {
  return unit.find_first_of("/*") == std::string::npos && unit.find("·") == std::string::npos
             ? unit
             : "(" + unit + ")";
}

/// Crosstalk from a table's other axes, as candidates of their own.
std::vector<Effect> other_axes(const Observations& observations) {
  std::vector<Effect> effects;
  for (const std::string& axis : observations.other_axes) {
    const Covariate* load = observations.find(axis);
    const bool same = load == nullptr || load->unit == observations.unit;
    const std::string unit = same ? "1" : observations.unit + "/" + as_divisor(load->unit);
    effects.push_back(make_effect<OtherAxis>({.name = "crosstalk",
                                              .form = axis,
                                              .formula = "F + x F_other",
                                              .physics = "a load on another axis bends this one's spring",
                                              .parameters = {{"coefficient", unit, -1e12, 1e12}},
                                              .covariates = {axis},
                                              .additive = true,
                                              .form_is_axis = true,
                                              .sign_rule = "either",
                                              .force_N = {},
                                              .jet_N = {}}));
  }
  return effects;
}

void bound_by(double limit, EffectParameter& parameter) {
  if (parameter.lower < 0) parameter.lower = -limit;
  if (parameter.upper > 0) parameter.upper = limit;
}

/// With the bounds that hold for this table's response, where they are others. What a drift of the zero can
/// be is known of volts: in counts or newtons it depends on the converter and the cell, and only the sign is
/// left. An offset larger than all that was read is none: over the few speeds of one setting any would do. A
/// cell that bends by more than a tenth from no load to its largest is none.
std::optional<Effect> bounded_as_here(const Effect& effect, const Observations& observations) {
  constexpr double kNoBound = 1e12, kMostBent = 0.1;
  const double most_read = observations.value.cwiseAbs().maxCoeff();
  double lowest = observations.value.minCoeff(), highest = observations.value.maxCoeff();
  if (!observations.line_of_cell) {  // whose reading without a load is no force
    lowest = std::min(lowest, 0.0);
    highest = std::max(highest, 0.0);
  }
  Effect own = effect;
  bool differs = false;
  for (EffectParameter& parameter : own.parameters) {
    const bool in_volts = parameter.in_volts() && observations.unit != "V";
    const bool per_newton = parameter.per_newton();
    if (in_volts) bound_by(effect.origin == EffectOrigin::kOffset ? most_read : kNoBound, parameter);
    if (per_newton) bound_by(kMostBent / (highest - lowest), parameter);
    differs |= in_volts || per_newton;
  }
  if (!differs) return {};
  return own;
}

}  // namespace

TableEffects::TableEffects(const Observations& observations, const std::vector<const Effect*>& effects)
    : all(effects), own_(other_axes(observations)) {
  const std::size_t axes = own_.size();
  std::vector<const Effect*> replaced;  // of the program's own: a user's bounds are the user's
  for (const Effect& effect : all_effects()) {
    if (!observations.from_table) break;
    if (auto own = bounded_as_here(effect, observations)) {
      own_.push_back(std::move(*own));
      replaced.push_back(&effect);
    }
  }
  for (std::size_t i = 0; i < own_.size(); ++i) {
    const Effect* own = &own_[i];
    if (i < axes)
      all.push_back(own);
    else
      std::replace(all.begin(), all.end(), replaced[i - axes], own);
  }
}

}  // namespace tunnelrig
