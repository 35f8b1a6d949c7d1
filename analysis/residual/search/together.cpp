#include "analysis/residual/search/together.h"

#include "analysis/residual/search/best_run.h"
#include "analysis/residual/search/fits.h"
#include "analysis/residual/search/rules.h"
#include "analysis/residual/search/unseen.h"

#include <algorithm>
#include <utility>
#include <vector>

namespace tunnelrig {
namespace {

using Eigen::Index;

void add_together(Scan& scan, const std::vector<std::size_t>& ways, double weight) {
  Candidate together{.columns = {}, .sign = 0, .weight = weight * scan.candidates[ways[0]].weight};
  for (const std::size_t i : ways) together.columns.push_back(scan.candidates[i].columns[0]);
  std::vector<Term>& others = scan.others[scan.ways.size()];
  for (auto i = ways.begin() + 1; i != ways.end(); ++i) others.push_back(scan.ways[*i]);
  scan.candidates.push_back(std::move(together));
  scan.ways.push_back(scan.ways[ways[0]]);
}

/// Those that are there beside the others.
std::vector<Term> needed_of(const SearchData& data, const JointFit& base, std::vector<Term> terms) {
  constexpr double kNeeded = 1e-3;  // p of the likelihood ratio that one is there, beside the others
  while (terms.size() > 1) {
    const JointFit all = fit_with_all(data, base, terms);
    std::vector<double> p;
    for (std::size_t t = 0; t < terms.size(); ++t) {
      std::vector<Term> rest = terms;
      rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(t));
      const double ratio =
          all.variances.log_likelihood - fit_with_all(data, base, rest).variances.log_likelihood;
      p.push_back(ratio_p(data, std::max(0.0, ratio), all));
    }
    const auto least = std::max_element(p.begin(), p.end());
    if (*least <= kNeeded) break;
    terms.erase(terms.begin() + (least - p.begin()));
  }
  return terms;
}

/// Whether one of those that were left out does about as well in place of another. `all`: the terms' fit.
bool may_be_another(const SearchData& data, const JointFit& base, const std::vector<Term>& terms,
                    const std::vector<Term>& left_out, const JointFit& all) {
  constexpr double kTold = 3;  // log-likelihood: odds of 20
  for (const Term& other : left_out)
    for (std::size_t t = 0; t < terms.size(); ++t) {
      std::vector<Term> instead = terms;
      instead[t] = other;
      if (fit_with_all(data, base, instead).variances.log_likelihood > all.variances.log_likelihood - kTold)
        return true;
    }
  return false;
}

}  // namespace

void add_several_axes(Scan& scan) {
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

void add_pairs_of_steps(const SearchData& data, const NullFit& variances, Scan& scan) {
  constexpr double kWeight = 1. / 6;  // six pairs for four rotors, and rarer than one
  constexpr double kHiding = 1;  // σ_session²/σ_run² of what rotors differ by; below, no steps hide in it
  bool hiding = false;
  for (std::size_t s = 0; s < data.mixed().strata().size(); ++s) {
    const MixedModel::Stratum& stratum = data.mixed().strata()[s];
    hiding |= stratum.means() && stratum.side() == 1 && kRatios[variances.ratio[s]] >= kHiding;
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

std::optional<JointFit> fit_together(const SearchData& data, const Found& found, const Scan& scan,
                                     std::size_t i) {
  std::vector<Term> terms = {scan.ways[i]};
  const std::vector<Term>& others = scan.others.at(i);
  terms.insert(terms.end(), others.begin(), others.end());
  for (std::size_t t = 0; t < terms.size(); ++t)
    terms[t].parameters[0] = scan.fits[i].amplitude(static_cast<Index>(t));
  const bool pair = terms.size() == 2;
  std::vector<Term> left_out = terms;
  terms = needed_of(data, found.fit, std::move(terms));
  std::erase_if(left_out, [&](const Term& term) {
    return std::ranges::any_of(terms, [&](const Term& needed) { return needed.same_way(term); });
  });
  if (terms.size() < 2 ||
      found.accepted.size() + terms.size() > static_cast<std::size_t>(data.settings().most_effects))
    return std::nullopt;
  JointFit all = fit_with_all(data, found.fit, terms);
  if (!all.at_bound.empty() || (!pair && may_be_another(data, found.fit, terms, left_out, all)))
    return std::nullopt;
  const CrossValidation before = unseen(data, found.fit, all.variances),
                        after = unseen(data, all, all.variances);
  const LossDifference gain = compare(before, after);
  if (!(gain.mean > gain.standard_error)) return std::nullopt;
  if (pair && terms[0].effect->has_change_point() && is_gradual(data, found.fit, terms, all.variances, after))
    return std::nullopt;
  if (!pair) return all;
  const auto placed = [&](JointFit fit, std::size_t from_newest) {
    return at_best_run(data.observations(), std::move(fit), from_newest, data.rows()).fit;
  };
  return placed(placed(std::move(all), 1), 2);
}

}  // namespace tunnelrig
