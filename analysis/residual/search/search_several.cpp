// Effects of one name of which none may be seen alone. Two steps of two rotors at one run: what rotors have
// in common scatters less than what they differ by, and says of each of two opposite steps that there is
// none. Crosstalk from several axes: what the one does is scatter for the other.
#include "analysis/residual/search/search.h"

#include <algorithm>
#include <utility>

namespace tunnelrig {

using Eigen::Index;

void Search::add_together(Scan& scan, const std::vector<std::size_t>& ways, double weight) {
  Candidate together{.columns = {}, .sign = 0, .weight = weight * scan.candidates[ways[0]].weight};
  for (const std::size_t i : ways) together.columns.push_back(scan.candidates[i].columns[0]);
  std::vector<Term>& others = scan.others[scan.ways.size()];
  for (auto i = ways.begin() + 1; i != ways.end(); ++i) others.push_back(scan.ways[*i]);
  scan.candidates.push_back(std::move(together));
  scan.ways.push_back(scan.ways[ways[0]]);
}

void Search::add_several_axes(Scan& scan) const {
  std::vector<std::size_t> axes;
  for (std::size_t i = 0; i < scan.ways.size(); ++i)
    if (scan.ways[i].effect->of_other_axis() && !scan.ways[i].per_group) axes.push_back(i);
  constexpr std::size_t kMostAxes = 24;  // more channels are no cell's
  if (axes.size() > kMostAxes) return;
  const double pairs = static_cast<double>(axes.size() * (axes.size() - 1)) / 2;
  for (std::size_t a = 0; a < axes.size(); ++a)
    for (std::size_t b = a + 1; b < axes.size(); ++b) add_together(scan, {axes[a], axes[b]}, 1 / pairs);
  if (axes.size() > 2) add_together(scan, axes, 1);
}

void Search::add_pairs_of_steps(Scan& scan) const {
  constexpr double kWeight = 1. / 6;  // six pairs for four rotors, and rarer than one
  constexpr double kHiding = 1;  // σ_session²/σ_run² of what rotors differ by; below, no steps hide in it
  bool hiding = false;
  for (std::size_t s = 0; s < data_.mixed().strata().size(); ++s) {
    const MixedModel::Stratum& stratum = data_.mixed().strata()[s];
    hiding |= stratum.means() && stratum.side() == 1 && kRatios[found_.fit.variances.ratio[s]] >= kHiding;
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
      add_together(scan, {i, j}, kWeight);
    }
}

JointFit Search::fit_with_all(const std::vector<Term>& terms) const {
  MeanModel model = found_.fit.model;
  model.terms.insert(model.terms.end(), terms.begin(), terms.end());
  return fit_jointly(data_.observations(), model, data_.rows());
}

std::vector<Term> Search::needed_of(std::vector<Term> terms) const {
  constexpr double kNeeded = 1e-3;  // p of the likelihood ratio that one is there, beside the others
  while (terms.size() > 1) {
    const JointFit all = fit_with_all(terms);
    std::vector<double> p;
    for (std::size_t t = 0; t < terms.size(); ++t) {
      std::vector<Term> rest = terms;
      rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(t));
      const double ratio = all.variances.log_likelihood - fit_with_all(rest).variances.log_likelihood;
      p.push_back(ratio_p(std::max(0.0, ratio), all));
    }
    const auto least = std::max_element(p.begin(), p.end());
    if (*least <= kNeeded) break;
    terms.erase(terms.begin() + (least - p.begin()));
  }
  return terms;
}

bool Search::may_be_another(const std::vector<Term>& terms, const std::vector<Term>& left_out,
                            const JointFit& all) const {
  constexpr double kTold = 3;  // log-likelihood: odds of 20
  for (const Term& other : left_out)
    for (std::size_t t = 0; t < terms.size(); ++t) {
      std::vector<Term> instead = terms;
      instead[t] = other;
      if (fit_with_all(instead).variances.log_likelihood > all.variances.log_likelihood - kTold) return true;
    }
  return false;
}

bool Search::accept_together(const Scan& scan, std::size_t i, double p) {
  std::vector<Term> terms = {scan.ways[i]};
  const std::vector<Term>& others = scan.others.at(i);
  terms.insert(terms.end(), others.begin(), others.end());
  for (std::size_t t = 0; t < terms.size(); ++t)
    terms[t].parameters[0] = scan.fits[i].amplitude(static_cast<Index>(t));
  const bool pair = terms.size() == 2;
  std::vector<Term> left_out = terms;
  terms = needed_of(std::move(terms));
  std::erase_if(left_out, [&](const Term& term) {
    return std::ranges::any_of(terms, [&](const Term& needed) { return needed.same_way(term); });
  });
  if (terms.size() < 2 ||
      found_.accepted.size() + terms.size() > static_cast<std::size_t>(data_.settings().most_effects))
    return false;
  JointFit all = fit_with_all(terms);
  if (!all.at_bound.empty() || (!pair && may_be_another(terms, left_out, all))) return false;
  const CrossValidation before = unseen(found_.fit, all.variances), after = unseen(all, all.variances);
  const LossDifference gain = compare(before, after);
  if (!(gain.mean > gain.standard_error)) return false;
  if (pair && terms[0].effect->has_change_point() && is_gradual(terms, all.variances, after)) return false;
  all = pair ? at_best_run(at_best_run(std::move(all), 1), 2) : std::move(all);
  for (const Term& term : terms)
    found_.accepted.push_back({.term = term, .p = p, .together = true, .confounded = {}});
  found_.set_fit(std::move(all));
  return true;
}

}  // namespace tunnelrig
