// Two effects of one name of which neither may be seen alone. Two steps of two rotors at one run: what rotors
// have in common scatters less than what they differ by, and says of each of two opposite steps that there is
// none. Crosstalk from two axes: what the one does is scatter for the other.
#include "analysis/residual/search.h"

#include <algorithm>
#include <utility>

namespace tunnelrig {

void Search::add_pair(Scan& scan, std::size_t one, std::size_t two, double weight) {
  scan.partner[scan.ways.size()] = scan.ways[two];
  scan.candidates.push_back({.columns = {scan.candidates[one].columns[0], scan.candidates[two].columns[0]},
                             .sign = 0,
                             .weight = weight * scan.candidates[one].weight});
  scan.ways.push_back(scan.ways[one]);
}

void Search::add_pairs_of_axes(Scan& scan) const {
  std::vector<std::size_t> axes;
  for (std::size_t i = 0; i < scan.ways.size(); ++i)
    if (scan.ways[i].effect->name == "crosstalk" && !scan.ways[i].per_group) axes.push_back(i);
  const double pairs = static_cast<double>(axes.size() * (axes.size() - 1)) / 2;
  for (std::size_t a = 0; a < axes.size(); ++a)
    for (std::size_t b = a + 1; b < axes.size(); ++b) add_pair(scan, axes[a], axes[b], 1 / pairs);
}

void Search::add_pairs_of_steps(Scan& scan) const {
  constexpr double kWeight = 1. / 6;  // six pairs for four rotors, and rarer than one
  constexpr double kHiding = 1;  // σ_session²/σ_run² of what rotors differ by; below, no steps hide in it
  bool hiding = false;
  for (std::size_t s = 0; s < mixed_->strata().size(); ++s) {
    const MixedModel::Stratum& stratum = mixed_->strata()[s];
    hiding |= stratum.means() && stratum.side() == 1 && kRatios[fit_.variances.ratio[s]] >= kHiding;
  }
  if (!hiding) return;
  const auto is_step = [&](std::size_t i) {
    return scan.ways[i].rotor >= 0 && scan.ways[i].effect->has_change_point();
  };
  const std::size_t singles = scan.ways.size();
  for (std::size_t i = 0; i < singles; ++i)
    for (std::size_t j = i + 1; is_step(i) && j < singles; ++j) {
      const Term &one = scan.ways[i], &two = scan.ways[j];
      if (!is_step(j) || one.effect != two.effect || one.rotor == two.rotor ||
          one.parameters != two.parameters)
        continue;
      add_pair(scan, i, j, kWeight);
    }
}

bool Search::accept_pair(const Scan& scan, std::size_t i, double p) {
  constexpr double kNeeded = 1e-3;  // p of the likelihood ratio that each is there, beside the other
  const Term &one = scan.ways[i], &two = scan.partner.at(i);
  if (static_cast<int>(result_.accepted.size()) + 2 > settings_.most_effects) return false;
  const auto fit_of = [&](const std::vector<std::pair<Term, double>>& terms) {
    MeanModel model = fit_.model;
    for (const auto& [term, amplitude] : terms) {
      model.terms.push_back(term);
      model.terms.back().parameters[0] = amplitude;
    }
    return fit_jointly(observations_, model, rows_);
  };
  const double first = scan.fits[i].amplitude(0), second = scan.fits[i].amplitude(1);
  JointFit both = fit_of({{one, first}, {two, second}});
  if (!both.at_bound.empty()) return false;
  for (const JointFit& without : {fit_of({{one, first}}), fit_of({{two, second}})})
    if (ratio_p(std::max(0.0, both.variances.log_likelihood - without.variances.log_likelihood), both) >
        kNeeded)
      return false;
  const auto errors_of = [&](const JointFit& fit) {
    return cross_validate(observations_, difference(y_, fit.linear.offset), fit.linear.columns,
                          both.variances, rows_);
  };
  const CrossValidation before = errors_of(fit_), after = errors_of(both);
  const LossDifference gain = compare(before, after);
  if (!(gain.mean > gain.standard_error)) return false;
  if (one.effect->has_change_point() && is_gradual({one, two}, both.variances, after)) return false;
  fit_ = at_best_run(at_best_run(std::move(both), 1), 2);
  const auto terms = fit_.model.terms.end();
  for (const auto& term : {*(terms - 2), *(terms - 1)})
    result_.accepted.push_back(
        {.term = term, .p = p, .gain = before.rmse() - after.rmse(), .confounded = {}});
  read_back_terms();
  return true;
}

}  // namespace tunnelrig
