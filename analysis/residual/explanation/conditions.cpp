// What the conditions of the runs cannot show.
#include "analysis/residual/explanation/explanation_parts.h"
#include "analysis/residual/likelihood/candidates.h"
#include "analysis/residual/observations/condition_values.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace tunnelrig {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

std::vector<Untestable> untestable_effects(const Observations& observations,
                                           const std::vector<const Effect*>& effects) {
  std::map<std::string, std::vector<Untestable>> by_name;
  std::set<std::string> testable;
  const CanBeFound can_be_found(observations);
  for (const Effect* effect : effects) {
    const Testability can = can_be_found(*effect);
    if (can.ok())
      testable.insert(effect->name);
    else
      by_name[effect->name].push_back({effect->name, can.reason, can.missing});
  }
  std::vector<Untestable> result;
  for (auto& [name, list] : by_name)
    if (!testable.contains(name)) result.push_back(std::move(list.front()));
  return result;
}

/// Whether the zeros of runs are by tares that have its conditions.
bool has_tares(const Observations& observations, const Effect& effect) {
  return std::ranges::all_of(effect.covariates, [&](const std::string& name) {
    const Covariate* covariate = observations.find(name);
    return covariate != nullptr && covariate->at_zero.size() > 0;
  });
}

constexpr std::string_view kNoValue = "it has no value in ";

std::string no_value_in_words(const Effect& effect, const Observations& observations, Index row) {
  std::vector<std::string> conditions;
  for (const std::string& name : effect.covariates)
    if (const Covariate* covariate = observations.find(name))
      conditions.push_back(fmt::format("{} = {:.4g}", name, covariate->value(row, 0)));
  return fmt::format("{}{} ({})", kNoValue, observations.name[static_cast<std::size_t>(row)],
                     fmt::join(conditions, ", "));
}

/// The first run of a change-point's interval from which on a condition has none of the values before it.
std::optional<Index> changes_for_good(const Observations& observations, const Covariate& covariate,
                                      const ParameterEstimate& point) {
  constexpr int kMostValues = 4;  // what changes all the time changes there as well
  if (covariate.derived || covariate.per_channel() || !covariate.value.allFinite() ||
      different_values(covariate, observations.all_rows()) > kMostValues)
    return {};
  const auto begin = covariate.value.data(), end = begin + covariate.value.rows();
  const Index most = std::min(static_cast<Index>(point.high), observations.rows() - 1);
  for (Index first = std::max(static_cast<Index>(point.low), Index{1}); first <= most; ++first) {
    const std::set<double> before(begin, begin + first);
    if (std::none_of(begin + first, end, [&](double value) { return before.contains(value); })) return first;
  }
  return {};
}

}  // namespace

CanBeFound::CanBeFound(const Observations& observations)
    : observations_(observations),
      rows_(observations.all_rows()),
      baseline_(MixedModel::baseline_alone(observations, rows_)),
      // has_evidence_ is set by a constructor that clang-tidy does not see.
      // NOLINTNEXTLINE(clang-analyzer-optin.cplusplus.UninitializedObject)
      has_evidence_(observations, baseline_) {}

/// The first row in which the first way has no value, where none of them has one in all rows.
std::optional<Index> CanBeFound::undefined_in_all(const std::vector<Term>& ways) const {
  std::optional<Index> first;
  for (const Term& way : ways) {
    const auto row = has_evidence_.undefined(way);
    if (!row) return {};
    if (!first) first = row;
  }
  return first;
}

/// Whether it does something within a location, but not to first order.
bool CanBeFound::is_flat_at_zero(Term way) const {
  constexpr double kRounding = 1e-9;
  const EffectParameter& amplitude = way.effect->parameters[0];
  const Eigen::MatrixXd predicted =
      predict_response(observations_, {terms_of_theory(observations_), {}}, rows_);
  if (!respond(way, observations_, predicted).derivative[0][0].isZero(0)) return false;
  way.parameters[0] = amplitude.upper > 0 ? amplitude.upper : amplitude.lower;
  Components components(1 + observations_.shape.size(),
                        Eigen::MatrixXd::Zero(observations_.rows(), observations_.channels()));
  components[0] = respond(way, observations_, predicted).value[0];
  return components[0].cwiseAbs().maxCoeff() > kRounding && baseline_.sees(components);
}

Testability CanBeFound::operator()(const Effect& effect) const {
  Testability can = testability(effect, observations_);
  if (!can.ok()) return can;
  const std::vector<Term> ways = ways_to_try(effect, observations_, rows_);
  if (ways.empty())
    can.reason = "there are too few blocks on both sides of any step";
  else if (const auto row = undefined_in_all(ways))
    can.reason = no_value_in_words(effect, observations_, *row);
  else if (std::none_of(ways.begin(), ways.end(), std::cref(has_evidence_)))
    can.reason = std::ranges::any_of(ways, [&](const Term& way) { return is_flat_at_zero(way); })
                     ? fmt::format(
                           "its derivative by {0} is 0 where {0} is 0, and it is sought by that: let the "
                           "force change in proportion to a small {0}",
                           effect.parameters[0].name)
                 : effect.of_zero && has_tares(observations_, effect) ? "the tares take it off"
                 : observations_.from_table
                     ? "it does not vary within any group beside the baseline, which absorbs it"
                     : "it does not vary within any location, so the location's coefficient absorbs it";
  return can;
}

void report_untestable(const Observations& observations, const std::vector<const Effect*>& effects,
                       const std::vector<int>& rows, Explanation& explanation) {
  explanation.untestable = untestable_effects(observations, effects);
  for (const Untestable& entry : explanation.untestable)
    if (entry.reason.starts_with(kNoValue))
      explanation.warnings.push_back(fmt::format("{} is not tried: {}", entry.effect, entry.reason));
  report_unseen_conditions(observations, effects, rows, explanation);
}

void warn_of_changes_at_steps(const Observations& observations, Explanation& explanation) {
  if (observations.from_table) return;  // whose rows need not be in order of time
  for (const AdoptedEffect& adopted : explanation.adopted)
    for (const ParameterEstimate& point : adopted.parameters)
      for (const Covariate& covariate : observations.covariates) {
        const auto first =
            point.run.empty() ? std::nullopt : changes_for_good(observations, covariate, point);
        if (first)
          explanation.warnings.push_back(fmt::format(
              "{} changes at run {}, where {} may have happened as well: it may be what changed",
              covariate.name, observations.name[static_cast<std::size_t>(*first)], adopted.term.label()));
      }
}

namespace {

/// Of numbers that rows have: the names of those whose every row scatters more than most.
std::vector<std::string> that_scatter(const Eigen::VectorXd& scatter, const std::vector<int>& number,
                                      const std::vector<std::string>& name) {
  std::vector<double> least(name.size(), std::numeric_limits<double>::infinity());
  for (std::size_t row = 0; row < number.size(); ++row) {
    double& of = least[static_cast<std::size_t>(number[row])];
    of = std::min(of, scatter(static_cast<Eigen::Index>(row)));
  }
  std::vector<std::string> result;
  for (std::size_t i = 0; i < name.size(); ++i)
    if (least[i] > 1 && std::isfinite(least[i])) result.push_back(name[i]);
  return result;
}

/// "runs at H2V0, H3V-1 scatter more than most, up to 8.3 times"
std::string wilder_runs(const Observations& observations) {
  const Eigen::VectorXd& scatter = observations.scatter.runs;
  std::vector<std::string> names = that_scatter(scatter, observations.group, observations.group_name);
  for (const std::string& session : that_scatter(scatter, observations.block, observations.block_name))
    names.push_back("session " + session);
  return fmt::format("runs at {} scatter more than most, up to {:.2g} times", fmt::join(names, ", "),
                     scatter.maxCoeff());
}

/// "differences of rotors scatter unlike each other (…, rotors 1 + 3 − 2 − 4: 0.62, …)"
std::string unlike_contrasts(const Observations& observations) {
  const Eigen::MatrixXd modes = modes_of(observations.scatter, observations.channels());
  std::vector<std::string> contrasts;
  for (Eigen::Index k = 0; k < observations.scatter.contrasts.size(); ++k) {
    std::array<std::vector<int>, 2> sides;
    for (int rotor = 0; rotor < modes.rows(); ++rotor)
      sides[modes(rotor, k + 1) > 0 ? 0 : 1].push_back(rotor + 1);
    contrasts.push_back(fmt::format("{} − {}: {:.2f}", fmt::join(sides[0], " + "), fmt::join(sides[1], " − "),
                                    observations.scatter.contrasts(k)));
  }
  return fmt::format("differences of rotors scatter unlike each other (over their geometric mean, rotors {})",
                     fmt::join(contrasts, ", "));
}

}  // namespace

void warn_of_scatter(const Observations& observations, Explanation& explanation) {
  if (observations.scatter.contrasts.size() > 0)
    explanation.warnings.push_back(unlike_contrasts(observations) + ": allowed for");
  if (observations.scatter.rotors.size() > 0)
    explanation.warnings.push_back(
        fmt::format("rotors scatter unlike each other (over their geometric mean: {:.2f}): allowed for",
                    fmt::join(observations.scatter.rotors, ", ")));
  if (const auto& rotors = observations.scatter.sessions.rotors; !rotors.empty()) {
    std::vector<int> from_one;
    for (const int rotor : rotors) from_one.push_back(rotor + 1);
    explanation.warnings.push_back(
        fmt::format("sessions of rotor {} differ by more than the others' (a tare that repeats badly, a cell "
                    "mounted anew): allowed for",
                    fmt::join(from_one, " and rotor ")));
  }
  if (observations.scatter.runs.size() > 0)
    explanation.warnings.push_back(fmt::format("{}: allowed for", wilder_runs(observations)));
  if (const auto& [names, runs] = observations.scatter.by_condition; !names.empty())
    explanation.warnings.push_back(fmt::format(
        "{} scatter more or less with {} ({:.2g} to {:.2g} times their mean scatter): weighed by it",
        observations.from_table ? "rows" : "runs", fmt::join(names, " and "), runs.minCoeff(),
        runs.maxCoeff()));
  constexpr std::array<std::string_view, 2> kOf = {"all rotors together", "one rotor against another"};
  for (std::size_t s = 0; s < kOf.size(); ++s) {
    const double correlation = observations.scatter.run_correlation[s];
    if (correlation == 0) continue;
    explanation.warnings.push_back(
        fmt::format("neighbouring {} resemble each other (correlation {:.2f}{}{}): allowed for",
                    observations.from_table ? "rows" : "runs", correlation,
                    observations.channels() > 1 ? " of " : "", observations.channels() > 1 ? kOf[s] : ""));
  }
}

}  // namespace tunnelrig
