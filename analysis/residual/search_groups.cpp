// An effect whose amplitude is each group's own.
#include "analysis/residual/group_amplitudes.h"
#include "analysis/residual/search.h"
#include "calibration/distributions.h"

#include <algorithm>
#include <cmath>

namespace tunnelrig {

using Eigen::Index;

void Search::let_groups_differ(bool before_others) {
  if (observations_.channels() > 1 || observations_.groups() < 2 || result_.accepted.empty() ||
      result_.accepted.back().term.per_group)
    return;
  const Term shared = result_.accepted.back().term;
  Term own = shared;
  own.per_group = true;
  own.at_theory = false;
  own.parameters[0] = 0;
  Observations wider = observations_;
  const TermResponse response = respond(own, wider, predict_response(wider, fit_.model, rows_));
  wider.slopes.conservativeResize(Eigen::NoChange, wider.slopes.cols() + 1);
  wider.slopes.rightCols(1) = response.derivative[0][0];
  MeanModel model = fit_.model;
  model.terms.back() = own;
  JointFit fit = fit_jointly(wider, model, rows_);
  const auto before = sum_of_squares(observations_, fit_), after = sum_of_squares(wider, fit);
  const double more = before.second - after.second;
  if (more <= 0 || after.second <= 0) return;
  const double f = (before.first - after.first) / more / (after.first / after.second);
  if (!(f > 0) || f_upper_p(f, more, after.second) > settings_.alpha) return;
  if (!fit.at_bound.empty()) return;
  const CrossValidation with_own =
      cross_validate(wider, difference(y_, fit.linear.offset), fit.linear.columns, fit.variances, rows_);
  const LossDifference gain = compare(cross_validate(observations_, difference(y_, fit_.linear.offset),
                                                     fit_.linear.columns, fit.variances, rows_),
                                      with_own);
  if (!(gain.mean > gain.standard_error)) return;
  if (!groups_within_bounds(wider, fit.model)) return;
  if (before_others && another_does_as_well(with_own, fit.variances)) return;
  observations_ = std::move(wider);
  make_models();
  fit_ = std::move(fit);
  read_back_terms();
}

bool Search::another_does_as_well(const CrossValidation& own, const NullFit& variances) const {
  constexpr std::size_t kTried = 3;
  if (static_cast<int>(result_.accepted.size()) >= settings_.most_effects) return false;
  const Scan scan = scan_effects(fit_);
  std::vector<std::string> tried;
  for (const std::size_t i : scan.order) {
    const std::string& name = scan.ways[i].effect->name;
    if (scan.fits[i].evidence < critical_ || tried.size() == kTried) break;
    if (std::find(tried.begin(), tried.end(), name) != tried.end()) continue;
    tried.push_back(name);
    const JointFit fit = fit_with(scan.ways[i], scan.fits[i].amplitude(0));
    if (!fit.at_bound.empty()) continue;
    const CrossValidation with_both = cross_validate(observations_, difference(y_, fit.linear.offset),
                                                     fit.linear.columns, variances, rows_);
    if (!compare(with_both, own).told_apart()) return true;
  }
  return false;
}

bool Search::groups_within_bounds(const Observations& wider, const MeanModel& model) const {
  constexpr std::size_t kOneOf = 20;  // 95 % intervals
  const EffectParameter& amplitude = model.terms.back().effect->parameters[0];
  const auto groups = estimate_by_group(wider, model, model.terms.size() - 1, rows_);
  const auto outside = std::count_if(groups.begin(), groups.end(), [&](const GroupEstimate& group) {
    return group.low > amplitude.upper || group.high < amplitude.lower;
  });
  return static_cast<std::size_t>(outside) * kOneOf <= groups.size();
}

std::pair<double, double> Search::sum_of_squares(const Observations& observations,
                                                 const JointFit& fit) const {
  const MixedModel mixed(observations, rows_);
  const double dof = static_cast<double>(mixed.dof(0) - static_cast<Index>(fit.linear.columns.size()));
  return {std::pow(fit.variances.sigma[0], 2) * std::max(dof, 1.0), dof};
}

}  // namespace tunnelrig
