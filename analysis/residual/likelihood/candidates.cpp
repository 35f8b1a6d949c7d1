#include "analysis/residual/likelihood/candidates.h"

#include "analysis/residual/likelihood/joint_fit.h"
#include "analysis/residual/observations/condition_values.h"
#include "analysis/residual/observations/previous_run.h"
#include "datasets/units.h"

#include <algorithm>
#include <array>
#include <map>
#include <string_view>

#include <fmt/format.h>

namespace tunnelrig {
namespace {

using Eigen::MatrixXd;

/// Of rising numbers of rows, those with a group that has rows before and from there on: a step between
/// groups is their difference.
std::vector<double> within_a_group(const Observations& observations, const std::vector<int>& rows,
                                   const std::vector<double>& points) {
  const std::map<int, std::vector<int>> of_groups = rows_of_each(observations.group, rows);
  std::vector<double> result;
  auto next = rows.begin();
  int last = -1;  // row of any group that has rows before the point
  for (const double point : points) {
    for (; next != rows.end() && *next < point; ++next)
      last = std::max(last, of_groups.at(observations.group[static_cast<std::size_t>(*next)]).back());
    if (last >= point) result.push_back(point);
  }
  return result;
}

/// Run numbers at which a change-point leaves enough blocks of `rows` on both sides: the first run of each
/// block, where a group goes on. Of a long table some, evenly spread: a step that is found is placed after.
std::vector<double> change_points(const Observations& observations, const std::vector<int>& rows) {
  std::vector<int> blocks;
  std::vector<double> first;
  for (const int row : rows) {
    const int block = observations.block[static_cast<std::size_t>(row)];
    if (blocks.empty() || blocks.back() != block) {
      blocks.push_back(block);
      first.push_back(row);
    }
  }
  if (static_cast<int>(blocks.size()) < 2 * kLeastBlocksBesideAStep) return {};
  std::vector<double> points{first.begin() + kLeastBlocksBesideAStep,
                             first.end() - kLeastBlocksBesideAStep + 1};
  const double least = kLeastShareBesideAStep * static_cast<double>(rows.size());
  std::erase_if(points, [&](double point) {
    const auto before = static_cast<double>(std::ranges::lower_bound(rows, point) - rows.begin());
    return before < least || static_cast<double>(rows.size()) - before < least;
  });
  points = within_a_group(observations, rows, points);
  constexpr std::size_t kMost = 300;
  const std::size_t every = std::max<std::size_t>(1, (points.size() + kMost - 1) / kMost);
  std::vector<double> some;
  for (std::size_t k = every / 2; k < points.size(); k += every) some.push_back(points[k]);
  return some;
}

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

/// What the air's temperature does to a cell whose own is not known.
bool is_of_a_cell_in_the_air(const Effect& effect) {
  const bool drift = effect.name == "span_drift_temperature" || effect.name == "zero_drift_temperature";
  return effect.name == "temperature_gradient" || (drift && effect.form == "air");
}

/// What the air's state does to a force.
bool is_of_air(const Effect& effect) {
  constexpr std::array<std::string_view, 3> kOfAir = {"air_humidity", "air_pressure", "air_temperature"};
  return std::ranges::count(kOfAir, effect.name) > 0;
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

}  // namespace

Testability testability(const Effect& effect, const Observations& observations) {
  Testability result;
  bool varies = effect.covariates.empty();
  for (const std::string& name : effect.covariates) {
    const Covariate* covariate = observations.find(name);
    if (covariate == nullptr) {
      result.missing.push_back(name);
      continue;
    }
    varies |= !is_constant(*covariate);
    if (const auto why = observations.not_usable.find(name); why != observations.not_usable.end())
      result.reason = name + " is " + why->second;
    if (!covariate->labels.empty()) result.reason = name + " is a column of texts";
    if (covariate->derived && covariate->value.isZero(0)) result.reason = name + " is 0 in every run";
  }
  // What is left then goes with the force alone, which says nothing of the condition.
  if (observations.from_table && !varies && result.missing.empty())
    result.reason =
        fmt::format("{} the same in every row",
                    effect.covariates.size() == 1 ? effect.covariates[0] + " is" : "its conditions are");
  // With the standard's air nothing changes, and a gradient is the drift of zero by another name.
  if ((effect.name == "air_temperature" || effect.name == "temperature_gradient") &&
      observations.assumed.contains("air_temperature_C"))
    result.missing.emplace_back("air_temperature_C");
  else if (effect.name == "air_temperature" && (!observations.of_air || observations.is_line()))
    result.reason =
        "only a table's thrust, coefficient, power or torque is held against a baseline without the density "
        "of its air";
  if (observations.of_no_cell && !observations.is_line() &&
      (is_of_air(effect) || is_of_a_cell_in_the_air(effect)))
    result.reason =
        "nothing says that a cell read the response, or that the air is in it: it is a number without a "
        "unit, a "
        "time, a length or the like";
  const bool bends = effect.name == "nonlinearity" || effect.name == "bidirectional";
  if (is_of("power", observations) && (bends || is_of_a_cell_in_the_air(effect)))
    result.reason = "a power is no force that a cell has read";
  if (effect.name == "axial_wind" && (observations.of_no_cell || is_of("pressure", observations)))
    result.reason = "nothing says that the response is a rotor's, through which the wind would go";
  if (effect.name == "tip_mach" && observations.from_table) {
    if (observations.find(kDiameter) == nullptr) result.missing.emplace_back(kDiameter);
    if (const auto why = observations.not_usable.find(std::string(kDiameter));
        why != observations.not_usable.end())
      result.reason = fmt::format("{} is {}", kDiameter, why->second);
  }
  if (effect.name == "air_pressure" && is_made_c_t(observations))
    result.reason = "the pressure is in the density that thrusts are divided by";
  if (effect.scope == EffectScope::kPair && observations.channels() < 2)
    result.reason = "the response has one channel";
  if (effect.tunnel_only &&
      std::none_of(observations.in_tunnel.begin(), observations.in_tunnel.end(), [](bool in) { return in; }))
    result.reason = "no run stands in a tunnel";
  if (effect.name == "bidirectional" && observations.multiplicative)
    result.reason = "the response has one sign";
  if (observations.coefficient && effect.name == "rotor_speed")
    result.reason = "the measured speed is part of the response";
  else if (effect.name == "rotor_speed" && !goes_with_speed_squared(observations))
    result.reason =
        "only forces, torques and what a cell reads of them go with the square of the speed: give the "
        "response "
        "its unit";
  const bool no_force = observations.coefficient ? !is_made_c_t(observations)
                                                 : observations.of_no_cell && !observations.is_line();
  if (no_force && bends)
    result.reason = fmt::format("a {} is no force that a cell has read",
                                observations.coefficient ? "coefficient" : "number");
  if (effect.name == "zero_offset" && !shows_zero_offset(observations))
    result.reason =
        is_made_c_t(observations) && !observations.multiplicative
            ? "the baseline has a constant beside C_T"
            : "only a table's thrust whose speed was measured shows it, by how large it is beside small ones";
  if (effect.needs_previous && std::all_of(observations.previous.begin(), observations.previous.end(),
                                           [](int before) { return before < 0; }))
    result.reason = "the rows have no order, which a condition run_order would give them";
  else if (effect.needs_previous && !forces_differ(observations))
    result.reason = "the forces differ too little beside their scatter for the run before to tell";
  return result;
}

std::vector<std::string> own_conditions(const Effect& effect, const Observations& observations) {
  const bool of_force_alone = effect.covariates.empty() && effect.scope != EffectScope::kPair &&
                              !effect.needs_previous && !effect.has_change_point();
  if (!of_force_alone) return effect.covariates;
  if (!observations.baseline_over.empty()) return {observations.baseline_over};
  const bool of_rotors = !observations.from_table || observations.of_air;
  if (of_rotors && observations.find("speed_rpm") != nullptr) return {"speed_rpm"};
  return {};
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

std::vector<Term> ways_to_try(const Effect& effect, const Observations& observations,
                              const std::vector<int>& rows) {
  std::vector<Term> ways = {
      {.effect = &effect, .parameters = std::vector<double>(effect.parameters.size(), 0.0)}};
  const int channels = static_cast<int>(observations.channels());
  if (effect.scope == EffectScope::kRotor && channels > 1) {
    for (int rotor = 0; rotor < channels; ++rotor) {
      ways.push_back(ways[0]);
      ways.back().rotor = rotor;
    }
  }
  if (effect.scope == EffectScope::kPair) {
    const Term blank = ways[0];
    ways.clear();
    for (int to = 0; to < channels; ++to)
      for (int from = 0; from < channels; ++from) {
        if (to == from) continue;
        ways.push_back(blank);
        ways.back().rotor = to;
        ways.back().other = from;
      }
  }
  for (std::size_t k = 1; k < effect.parameters.size(); ++k) {
    const std::vector<double> grid = effect.parameters[k].role == ParameterRole::kChangePoint
                                         ? change_points(observations, rows)
                                         : effect.parameters[k].grid;
    std::vector<Term> shaped;
    for (const Term& way : ways)
      for (const double value : grid) {
        shaped.push_back(way);
        shaped.back().parameters[k] = value;
      }
    ways = std::move(shaped);
  }
  return ways;
}

}  // namespace tunnelrig
