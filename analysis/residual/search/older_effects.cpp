#include "analysis/residual/search/older_effects.h"

#include "analysis/residual/search/effect_scan.h"
#include "analysis/residual/search/fits.h"

#include <algorithm>
#include <map>
#include <optional>
#include <string>

namespace tunnelrig {
namespace {

constexpr double kSwapDecades = 0.7;  // another explains that much better: it takes the place

bool is_other_form(const Term& way, const Term& of) {
  return way.effect != of.effect && way.effect->cause() == of.effect->cause() &&
         way.effect->covariates == of.effect->covariates && way.rotor == of.rotor && way.other == of.other &&
         !way.per_group;
}

double worth(const JointFit& fit) {
  std::size_t free = 0;
  for (const Term& term : fit.model.terms)
    if (!term.effect->has_change_point()) free += term.parameters.size() - (term.at_theory ? 1 : 0);
  return fit.variances.log_likelihood - kRatioOfOneParameter * static_cast<double>(free);
}

void put_in_place(Found& found, std::size_t t, const JointFit& tried, double p) {
  found.make_newest(t, tried);
  found.accepted.back().p = p;
}

/// Whether accepted effect t gave way: to another, or to nothing where neither is beyond chance.
bool gives_way(const SearchData& data, Found& found, std::size_t t, Questions& questions) {
  const Accepted& old = found.accepted[t];
  if (old.term.per_group || old.term.effect->theory_only)
    return false;  // as for a curve (drop_what_a_curve_replaces)
  const JointFit without = fit_without(data, found.fit, t);
  const Scan scan = scan_effects(data, found, without);
  if (scan.order.empty()) return false;
  const std::size_t best = scan.order[0];
  const double own = evidence_of(scan, old.term);
  std::optional<JointFit> better;
  if (!scan.ways[best].same_way(old.term) && scan.fits[best].evidence > own + kSwapDecades) {
    better = fit_with(data, without, scan.ways[best], scan.fits[best].amplitude(0));
    if (!(better->variances.log_likelihood > found.fit.variances.log_likelihood) || !better->at_bound.empty())
      better.reset();
  }
  // What was taken for one of several is settled by what they do together.
  if (!better && (old.together || own >= found.critical)) return false;
  NullMaxima maxima = questions.maxima_of(data, without, scan, Draws::kEffects);
  const double p = maxima.p(better ? scan.fits[best].evidence : own);
  if (p > data.settings().alpha)
    found.drop(t, without);  // with the newest in, neither is beyond chance
  else if (better)
    put_in_place(found, t, *better, p);
  else
    return false;
  return true;
}

}  // namespace

void ask_older_again(const SearchData& data, Found& found, Questions& questions) {
  for (std::size_t t = 0; t + 1 < found.accepted.size();)
    if (!gives_way(data, found, t, questions)) ++t;
}

bool change_a_form(const SearchData& data, Found& found, Questions& questions) {
  for (std::size_t t = 0; t < found.accepted.size(); ++t) {
    const Term old = found.accepted[t].term;
    const auto other = [&](const Term& way) { return is_other_form(way, old); };
    if (old.per_group || std::ranges::none_of(data.ways(), other)) continue;
    const JointFit without = fit_without(data, found.fit, t);
    const Scan scan = scan_effects(data, found, without);
    std::map<std::string, std::size_t> best;  // way of each form
    for (const std::size_t i : scan.order)
      if (other(scan.ways[i])) best.emplace(scan.ways[i].effect->form, i);
    for (const auto& [form, i] : best) {
      const JointFit tried = fit_with(data, without, scan.ways[i], scan.fits[i].amplitude(0));
      if (!(worth(tried) > worth(found.fit)) || !tried.at_bound.empty()) continue;
      const double p = questions.maxima_of(data, without, scan, Draws::kEffects).p(scan.fits[i].evidence);
      if (p > data.settings().alpha) continue;
      put_in_place(found, t, tried, p);
      return true;
    }
  }
  return false;
}

bool is_still_found(const SearchData& data, const Found& found, const Term& term, const JointFit& without,
                    Questions& questions) {
  const Scan scan = scan_effects(data, found, without);
  if (scan.order.empty()) return false;
  return questions.maxima_of(data, without, scan, Draws::kStillFound).p(evidence_of(scan, term)) <=
         data.settings().alpha;
}

}  // namespace tunnelrig
