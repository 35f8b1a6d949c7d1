// Effects that give way to another one, or to another form of their own, with a newer effect in.
#include "analysis/residual/search/effect_scan.h"
#include "analysis/residual/search/fits.h"
#include "analysis/residual/search/search.h"

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

}  // namespace

void Search::ask_older_again() {
  for (std::size_t t = 0; t + 1 < found_.accepted.size();)
    if (!gives_way(t)) ++t;
}

bool Search::gives_way(std::size_t t) {
  const Accepted& old = found_.accepted[t];
  if (old.term.per_group || old.term.effect->theory_only)
    return false;  // as for a curve (drop_what_a_curve_replaces)
  const JointFit without = fit_without(data_, found_.fit, t);
  const Scan scan = scan_effects(data_, found_, without);
  if (scan.order.empty()) return false;
  const std::size_t best = scan.order[0];
  const double own = evidence_of(scan, old.term);
  std::optional<JointFit> better;
  if (!scan.ways[best].same_way(old.term) && scan.fits[best].evidence > own + kSwapDecades) {
    better = fit_with(data_, without, scan.ways[best], scan.fits[best].amplitude(0));
    if (!(better->variances.log_likelihood > found_.fit.variances.log_likelihood) ||
        !better->at_bound.empty())
      better.reset();
  }
  // What was taken for one of several is settled by what they do together.
  if (!better && (old.together || own >= found_.critical)) return false;
  NullMaxima maxima = questions_.maxima_of(data_, without, scan, Draws::kEffects);
  const double p = maxima.p(better ? scan.fits[best].evidence : own);
  if (p > data_.settings().alpha)
    found_.drop(t, without);  // with the newest in, neither is beyond chance
  else if (better)
    put_in_place(t, *better, p);
  else
    return false;
  return true;
}

bool Search::change_a_form() {
  for (std::size_t t = 0; t < found_.accepted.size(); ++t) {
    const Term old = found_.accepted[t].term;
    const auto other = [&](const Term& way) { return is_other_form(way, old); };
    if (old.per_group || std::ranges::none_of(data_.ways(), other)) continue;
    const JointFit without = fit_without(data_, found_.fit, t);
    const Scan scan = scan_effects(data_, found_, without);
    std::map<std::string, std::size_t> best;  // way of each form
    for (const std::size_t i : scan.order)
      if (other(scan.ways[i])) best.emplace(scan.ways[i].effect->form, i);
    for (const auto& [form, i] : best) {
      const JointFit tried = fit_with(data_, without, scan.ways[i], scan.fits[i].amplitude(0));
      if (!(worth(tried) > worth(found_.fit)) || !tried.at_bound.empty()) continue;
      const double p = questions_.maxima_of(data_, without, scan, Draws::kEffects).p(scan.fits[i].evidence);
      if (p > data_.settings().alpha) continue;
      put_in_place(t, tried, p);
      return true;
    }
  }
  return false;
}

void Search::put_in_place(std::size_t t, const JointFit& tried, double p) {
  found_.make_newest(t, tried);
  found_.accepted.back().p = p;
}

bool Search::is_still_found(const Term& term, const JointFit& without) {
  const Scan scan = scan_effects(data_, found_, without);
  if (scan.order.empty()) return false;
  return questions_.maxima_of(data_, without, scan, Draws::kStillFound).p(evidence_of(scan, term)) <=
         data_.settings().alpha;
}

}  // namespace tunnelrig
