// Names that the opened seal refutes, and the protocol done again without them.
#include "analysis/residual/explanation/explanation_parts.h"
#include "calibration/distributions.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace tunnelrig {
namespace {

/// A time constant beyond all times that were seen, which may be twice as long as well: a straight line does
/// what the formula does, and of the state that it would settle in nobody has seen anything.
std::string no_more_than_a_line(const AdoptedEffect& adopted, const Observations& observations) {
  const Covariate* time = observations.find(kTimeSinceMotorStart);
  if (!adopted.term.effect->within_time() || time == nullptr) return "";
  const double longest_s = (time->value.rowwise().maxCoeff() + observations.duration_s).maxCoeff();
  for (std::size_t k = 1; k < adopted.parameters.size(); ++k) {
    const ParameterEstimate& constant = adopted.parameters[k];
    const double upper = adopted.term.effect->parameters[k].upper;
    if (constant.value > longest_s && (constant.high > 2 * constant.value || constant.high >= upper))
      return fmt::format("its {} is {:.3g} s and may be far longer, of which no run shows more than {:.3g} s",
                         constant.name, constant.value, longest_s);
  }
  return "";
}

/// What the opened seal refutes: single names, or all of them, since which is wrong is not known, and another
/// for the same would be chosen by the seal.
struct Refuted {
  std::vector<Term> terms;
  std::vector<std::string> why;  // of each of `terms`
  bool beyond = false;           // of one of them what is physical, was seen, or curves say: it never stays
  bool structure = false;        // of one of them the data have, in another shape
  bool all = false;
  bool any() const { return all || !terms.empty(); }
};

bool curves_do_better(const Explanation& explanation) {
  return is_worse(explanation.sealed.all, explanation.sealed.curves) && explanation.sealed.against_names;
}

/// Better than the names, whether what else was found is in or not.
bool baseline_does_better(const Explanation& explanation) {
  return is_worse(explanation.sealed.all, explanation.before.held_out_rmse) &&
         is_worse(explanation.sealed.names, explanation.before.held_out_rmse) &&
         explanation.sealed.against_adopted;
}

bool holds_0(const auto& estimate) { return estimate.low <= 0 && estimate.high >= 0; }

/// Whether amplitudes of the groups' own, of either sign, are all 0 as far as their 95 % intervals tell.
bool are_nothing(const std::vector<GroupEstimate>& groups) {
  double squares = 0;
  for (const GroupEstimate& group : groups)
    squares += std::pow((group.low + group.high) / (group.high - group.low), 2);
  return squares * chi2_quantile(0.95, 1) <= chi2_quantile(0.95, static_cast<double>(groups.size()));
}

/// Curves of the model over an effect's own conditions.
std::vector<const UnknownStructure*> curves_beside(const AdoptedEffect& adopted,
                                                   const Explanation& explanation,
                                                   const Observations& observations) {
  const std::vector<std::string> own = own_conditions(*adopted.term.effect, observations);
  std::vector<const UnknownStructure*> result;
  for (const UnknownStructure& curve : explanation.unknown)
    if (!curve.by_sealed_too && std::ranges::find(own, curve.condition) != own.end())
      result.push_back(&curve);
  return result;
}

/// A curve over its own condition beside it, in words, where the names alone make the error larger: of single
/// rotors beside what it says of all, it may be no more than what these leave of each other; of the same
/// rotors it is what the curve takes back.
std::string contradiction(const AdoptedEffect& adopted, const Explanation& explanation,
                          const Observations& observations) {
  const double after = explanation.after.held_out_rmse, before = explanation.before.held_out_rmse;
  if (after <= before) return "";
  for (const UnknownStructure* curve : curves_beside(adopted, explanation, observations)) {
    if (adopted.term.rotor < 0 && curve->rotor >= 0)
      return fmt::format(
          "curves of single rotors over {} say otherwise, and without them it makes the error larger",
          curve->condition);
    if (adopted.term.rotor == curve->rotor && is_worse(after, before))
      return fmt::format("a curve over {} takes it back, and without that it makes the error larger",
                         curve->condition);
  }
  return "";
}

/// Whether a curve over its own condition is beside a name whose amplitude may be 0: the curve has what it
/// was found for.
bool has_given_way(const AdoptedEffect& adopted, const Explanation& explanation,
                   const Observations& observations) {
  return !adopted.term.per_group && holds_0(adopted.parameters[0]) &&
         std::ranges::count(curves_beside(adopted, explanation, observations), adopted.term.rotor,
                            &UnknownStructure::rotor) > 0;
}

/// What speaks against a name.
struct Against {
  const AdoptedEffect* adopted;
  std::string why;
  bool never_stays;
};

/// Of several names that are refuted, those to take back before the rest is judged anew.
std::vector<Against> to_go_first(std::vector<Against> against, const Observations& observations) {
  // With the wrong one of two equals in, the sealed runs are far from all that was found, and no other effect
  // is seen beside it.
  const auto has_equals = [](const Against& refuted) { return !refuted.adopted->confounded_with.empty(); };
  if (std::ranges::any_of(against, has_equals)) std::erase_if(against, std::not_fn(has_equals));
  // Two formulas of one condition, neither of which is known beside the other, make any shape over it: the
  // newest is none, and the other is judged without it.
  for (std::size_t k = against.size(); k-- > 1;) {
    const Term& newer = against[k].adopted->term;
    const auto is_of_its_condition = [&](const Against& older) {
      const Term& term = older.adopted->term;
      return term.rotor == newer.rotor && share_a_condition(*term.effect, *newer.effect, observations);
    };
    if (std::none_of(against.begin(), against.begin() + static_cast<std::ptrdiff_t>(k), is_of_its_condition))
      continue;
    against[k].never_stays = true;
    return {against[k]};
  }
  return against;
}

Refuted refuted(const Explanation& explanation, const Observations& observations) {
  std::vector<Against> against;
  bool refutable = false;
  for (const AdoptedEffect& adopted : explanation.adopted) {
    refutable = refutable || !adopted.term.effect->theory_only;
    const std::string contradicted = contradiction(adopted, explanation, observations);
    std::string why = refutation(adopted, observations);
    if (why.empty()) why = contradicted;
    if (why.empty()) continue;
    const bool never_stays = adopted.at_bound || !contradicted.empty() ||
                             has_given_way(adopted, explanation, observations) ||
                             !no_more_than_a_line(adopted, observations).empty();
    against.push_back({&adopted, std::move(why), never_stays});
  }
  Refuted result;
  for (auto& [adopted, why, never_stays] : to_go_first(std::move(against), observations)) {
    result.terms.push_back(adopted->term);
    result.why.push_back(std::move(why));
    result.beyond |= never_stays;
    result.structure |= adopted->bends_away || adopted->anywhere;
  }
  result.all = result.terms.empty() && refutable &&
               (curves_do_better(explanation) || baseline_does_better(explanation));
  return result;
}

std::string taken_back_all(const Explanation& explanation) {
  std::vector<std::string> names;
  for (const AdoptedEffect& adopted : explanation.adopted)
    if (!adopted.term.effect->theory_only) names.push_back(adopted.term.label());
  return fmt::format(
      "{} found and taken back: the error of the sealed blocks is {:.4g}{} with {}, {:.4g} without",
      fmt::join(names, ", "), explanation.sealed.all, explanation.unit_suffix(),
      names.size() > 1 ? "them" : "it",
      curves_do_better(explanation) ? explanation.sealed.curves : explanation.before.held_out_rmse);
}

/// What was found, and what of it all runs refute.
struct Attempt {
  Explanation explanation;
  Refuted refuted;
  std::vector<const Effect*> effects;
  SearchSettings settings;
  std::size_t said;  // sentences before it
};

void say(const Refuted& refuted, bool stay, std::vector<std::string>& said) {
  for (std::size_t k = 0; k < refuted.terms.size(); ++k)
    said.push_back(
        refuted.terms[k].label() +
        (stay ? " stays, since the sealed blocks are predicted worse without it, though with them in, "
              : " was found and is taken back: with the sealed blocks in, ") +
        refuted.why[k]);
}

}  // namespace

Explanation without_refuted(Explanation explanation, const Observations& observations,
                            std::vector<const Effect*>& effects, SearchSettings& settings,
                            std::vector<std::string>& said) {
  std::vector<Attempt> before;
  Refuted found = refuted(explanation, observations);
  const bool chosen = explanation.seal_chose || found.any();
  for (; found.any(); found = refuted(explanation, observations)) {
    std::vector<const Effect*> fewer = effects;
    SearchSettings stricter = settings;
    stricter.taken_back.insert(stricter.taken_back.end(), found.terms.begin(), found.terms.end());
    if (found.all) std::erase_if(fewer, [](const Effect* effect) { return !effect->theory_only; });
    Explanation without = explain_once(observations, fewer, stricter);
    without.untestable = explanation.untestable;
    // What bends away from a formula, or is no step, is structure, and predicts as such.
    const double without_them = found.structure ? without.sealed.all : without.sealed.names;
    const bool harmful = is_worse(explanation.sealed.names, explanation.before.held_out_rmse);
    const bool stay = !found.beyond && !harmful &&
                      is_worse(explanation.sealed.curves, explanation.sealed.all) &&
                      is_worse(without_them, explanation.sealed.all);
    if (stay) {
      const auto as_well = std::ranges::find_if(before, [&](const Attempt& earlier) {
        return !earlier.refuted.all && !earlier.refuted.beyond &&
               !is_worse(earlier.explanation.sealed.all, explanation.sealed.all);
      });
      if (as_well == before.end()) {
        say(found, true, said);
        break;
      }
      said.resize(as_well->said);
      say(as_well->refuted, true, said);
      effects = std::move(as_well->effects);
      settings = std::move(as_well->settings);
      explanation = std::move(as_well->explanation);
      break;
    }
    before.push_back({std::move(explanation), found, effects, settings, said.size()});
    if (found.all) said.push_back(taken_back_all(before.back().explanation));
    say(found, false, said);
    explanation = std::move(without);
    effects = std::move(fewer);
    settings = std::move(stricter);
  }
  explanation.seal_chose = chosen;
  return explanation;
}

std::string refutation(const AdoptedEffect& adopted, const Observations& observations) {
  if (adopted.term.effect->theory_only || adopted.term.at_theory) return "";
  const ParameterEstimate& amplitude = adopted.parameters[0];
  if (adopted.at_bound && adopted.term.per_group)
    return fmt::format("its {} is outside the physical bounds in too many groups", amplitude.name);
  if (adopted.at_bound) return fmt::format("its {} is at its physical bound", amplitude.name);
  if (adopted.anywhere) return "when it happened is not known within half of the runs";
  for (std::size_t k = 1; k < adopted.parameters.size(); ++k) {
    const EffectParameter& bounds = adopted.term.effect->parameters[k];
    const ParameterEstimate& shape = adopted.parameters[k];
    if (bounds.role == ParameterRole::kShape && shape.low <= bounds.lower && shape.high >= bounds.upper)
      return fmt::format("its {} may be anything within its bounds", shape.name);
  }
  if (std::string line = no_more_than_a_line(adopted, observations); !line.empty()) return line;
  if (adopted.bends_away) {
    std::vector<std::string> by = own_conditions(*adopted.term.effect, observations);
    if (by.empty()) by = {"the force"};
    return fmt::format("what goes with {} bends away from its formula", fmt::join(by, ", "));
  }
  if (adopted.term.per_group)
    return are_nothing(amplitude.groups)
               ? fmt::format("the {}s of its groups are no further from 0 than their intervals let expect",
                             amplitude.name)
               : "";
  return holds_0(amplitude) ? fmt::format("the 95 % interval of its {} holds 0", amplitude.name) : "";
}

}  // namespace tunnelrig
