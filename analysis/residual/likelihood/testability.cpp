#include "analysis/residual/likelihood/testability.h"

#include "analysis/residual/likelihood/joint_fit.h"
#include "analysis/residual/observations/condition_values.h"
#include "analysis/residual/observations/previous_run.h"
#include "datasets/units.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include <fmt/format.h>

namespace tunnelrig {
namespace {

using Eigen::MatrixXd;

/// Whether the forces that the baseline predicts differ by clearly more than its constants scatter. What
/// depends on the force of the run before would otherwise depend on that run's scatter, of which its group's
/// constant has a part; all the more where a run's scatter goes with that of the run before.
bool forces_differ(const Observations& observations) {
  if (observations.rows() <= observations.groups()) return true;
  const bool correlated = observations.scatter.run_correlation != std::array<double, 2>{0, 0};
  const double least = correlated ? 40 : 3;  // variance over that of the constants' errors
  std::vector<int> seen;
  for (const int row : observations.all_rows())
    if (observations.has_response(row)) seen.push_back(row);
  const MatrixXd predicted = predict_response(observations, {known_terms(observations), {}}, seen);
  const MatrixXd force = observations.multiplicative ? MatrixXd(predicted.array().log()) : predicted;
  const double variance = (force.rowwise() - force.colwise().mean()).squaredNorm();
  return variance > least * variance_of_constants(observations, predicted).sum();
}

/// Whether the response is a thrust that its measured speed, and the density of its air, make C_T; another
/// coefficient came as one.
bool is_made_c_t(const Observations& observations) {
  return observations.coefficient && !observations.of_air;
}

/// Whether a constant error is another share of each row's force: where that goes with the measured speed,
/// and the baseline is no line or power law, which would take it up.
bool shows_zero_offset(const Observations& observations) {
  const bool thrust =
      observations.of_air && !observations.coefficient && observations.find("speed_rpm") != nullptr;
  return observations.from_table && observations.multiplicative && observations.baseline_over.empty() &&
         (is_made_c_t(observations) || thrust);
}

bool is_of(std::string_view quantity, const Observations& observations) {
  return observations.from_table && unit_from_name(observations.unit).quantity == quantity;
}

/// Powers go with its cube, and what is neither a force nor read by a cell has no such theory.
bool goes_with_speed_squared(const Observations& observations) {
  return !observations.from_table || !(observations.of_no_cell || is_of("power", observations));
}

bool goes_by_the_air(EffectOrigin origin) {
  return origin == EffectOrigin::kAirPressure || origin == EffectOrigin::kAirTemperature ||
         origin == EffectOrigin::kAirHumidity || origin == EffectOrigin::kCellInAir;
}

/// What the conditions of the rows say.
Testability by_conditions(const Effect& effect, const Observations& observations) {
  Testability result;
  bool varies = effect.covariates.empty();
  const auto need = [&](const std::string& name) {
    if (observations.find(name) == nullptr) result.missing.push_back(name);
    if (const auto why = observations.not_usable.find(name); why != observations.not_usable.end())
      result.reason = name + " is " + why->second;
  };
  for (const std::string& name : effect.covariates) {
    need(name);
    const Covariate* covariate = observations.find(name);
    if (covariate == nullptr) continue;
    varies |= !is_constant(*covariate);
    if (!covariate->labels.empty()) result.reason = name + " is a column of texts";
    if (covariate->derived && covariate->value.isZero(0)) result.reason = name + " is 0 in every run";
    // With the standard's air nothing changes, and a gradient is the drift of zero by another name.
    if (goes_by_the_air(effect.origin) && observations.assumed.contains(name)) result.missing.push_back(name);
  }
  if (effect.needs_diameters && observations.from_table) need(std::string(kDiameter));
  // What is left then goes with the force alone, which says nothing of the condition.
  if (observations.from_table && !varies && result.missing.empty() && result.reason.empty())
    result.reason =
        fmt::format("{} the same in every row",
                    effect.covariates.size() == 1 ? effect.covariates[0] + " is" : "its conditions are");
  return result;
}

/// Why the response is none that the origin of the effect would change, or none that would show it.
std::string against_origin(const Effect& effect, const Observations& observations) {
  const bool number = observations.of_no_cell && !observations.line_of_cell;
  const bool power = is_of("power", observations);
  constexpr auto kNumber =
      "nothing says that a cell read the response, or that the air is in it: it is a number without a "
      "unit, a time, a length or the like";
  constexpr auto kPower = "a power is no force that a cell has read";
  switch (effect.origin) {
    case EffectOrigin::kAny:
      return "";
    case EffectOrigin::kAirPressure:
      if (is_made_c_t(observations)) return "the pressure is in the density that thrusts are divided by";
      return number ? kNumber : "";
    case EffectOrigin::kAirTemperature:
      if (number) return kNumber;
      if (observations.of_air && !observations.line_of_cell) return "";
      return "only a table's thrust, coefficient, power or torque is held against a baseline without "
             "the density of its air";
    case EffectOrigin::kAirHumidity:
      return number ? kNumber : "";
    case EffectOrigin::kCellInAir:
      return power ? kPower : number ? kNumber : "";
    case EffectOrigin::kWind:
      if (!observations.from_table || observations.of_air || observations.coefficient) return "";
      return "nothing says that the response is a rotor's, through which the wind would go: give it its "
             "meaning";
    case EffectOrigin::kSpeedSquared:
      if (observations.coefficient) return "the measured speed is part of the response";
      if (goes_with_speed_squared(observations)) return "";
      return "only forces, torques and what a cell reads of them go with the square of the speed: give the "
             "response its unit";
    case EffectOrigin::kCharacteristic:
      if (observations.coefficient)
        return is_made_c_t(observations) ? "" : "a coefficient is no force that a cell has read";
      if (number) return "a number is no force that a cell has read";
      return power ? kPower : "";
    case EffectOrigin::kSupply:
      return observations.from_table && observations.coefficient
                 ? "it acts by the speed, which is a part of the response"
                 : "";
    case EffectOrigin::kMotor:
      return observations.line_of_cell ? "a load that a cell was given has no motor" : "";
    case EffectOrigin::kOffset:
      if (shows_zero_offset(observations)) return "";
      return is_made_c_t(observations) && !observations.multiplicative
                 ? "the baseline has a constant beside C_T"
                 : "only a table's thrust whose speed was measured shows it, by how large it is beside "
                   "small ones";
  }
  return "";
}

/// What the effect needs of channels, locations, signs and order that the rows do not have.
std::string against_design(const Effect& effect, const Observations& observations) {
  const auto nobody = [](const auto& of_rows, const auto& has) { return std::ranges::none_of(of_rows, has); };
  if (effect.needs_previous && nobody(observations.previous, [](int before) { return before >= 0; }))
    return "the rows have no order, which a condition run_order would give them";
  if (effect.needs_previous && !forces_differ(observations))
    return "the forces differ too little beside their scatter for the run before to tell";
  if (effect.needs_both_signs && observations.multiplicative) return "the response has one sign";
  if (effect.tunnel_only && nobody(observations.in_tunnel, [](bool in) { return in; }))
    return "no run stands in a tunnel";
  if (effect.scope == EffectScope::kPair && observations.channels() < 2)
    return "the response has one channel";
  return "";
}

}  // namespace

Testability testability(const Effect& effect, const Observations& observations) {
  Testability result = by_conditions(effect, observations);
  for (const auto against : {against_origin, against_design})
    if (std::string reason = against(effect, observations); !reason.empty())
      result.reason = std::move(reason);
  return result;
}

std::vector<std::string> own_conditions(const Effect& effect, const Observations& observations) {
  if (!effect.of_force_alone()) return effect.covariates;
  if (!observations.baseline_over.empty()) return {observations.baseline_over};
  const bool of_rotors = !observations.from_table || observations.of_air;
  if (of_rotors && observations.find("speed_rpm") != nullptr) return {"speed_rpm"};
  return {};
}

bool share_a_condition(const Effect& one, const Effect& other, const Observations& observations) {
  const std::vector<std::string> own = own_conditions(one, observations);
  return std::ranges::find_first_of(own, own_conditions(other, observations)) != own.end();
}

bool goes_by_the_law_alone(const Effect& effect, const Observations& observations) {
  if (observations.baseline_over.empty() || observations.line_of_cell) return false;
  const std::vector<std::string> by = own_conditions(effect, observations);
  const Covariate* over = observations.find(observations.baseline_over);
  const Covariate* own = by.size() == 1 ? observations.find(by[0]) : nullptr;
  if (over == nullptr || own == nullptr || !own->labels.empty()) return false;
  const Eigen::ArrayXd ratio = own->value.col(0).array() / over->value.col(0).array();
  return ((ratio - ratio(0)).abs() <= 1e-6 * std::abs(ratio(0))).all();
}

std::vector<Term> known_terms(const Observations& observations) {
  return observations.from_table ? std::vector<Term>() : terms_of_theory(observations);
}

std::vector<Term> terms_of_theory(const Observations& observations) {
  std::vector<Term> terms;
  for (const Effect& effect : all_effects())
    if (effect.theory_only && testability(effect, observations).ok())
      terms.push_back({.effect = &effect, .at_theory = true, .parameters = {*effect.theory()}});
  return terms;
}

}  // namespace tunnelrig
