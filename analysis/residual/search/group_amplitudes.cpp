#include "analysis/residual/search/group_amplitudes.h"

#include "calibration/distributions.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string_view>

namespace tunnelrig {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kLeastSeen = 1e-6;  // of a column: below it what is left is rounding

/// Amplitudes of a term by group, within its bounds; 0 where the group does not say.
VectorXd amplitudes_of(const Observations& observations, const JointFit& fit, std::size_t t,
                       const std::vector<int>& rows) {
  const EffectParameter& amplitude = fit.model.terms[t].effect->parameters[0];
  auto estimates = estimate_by_group(observations, fit.model, t, fit.variances, rows);
  for (GroupEstimate& estimate : estimates)
    estimate.value = std::clamp(estimate.value, amplitude.lower, amplitude.upper);
  return values_by_group(observations, estimates);
}

/// Of neighbouring rows of a group. Those with other groups' rows between them are no neighbours.
double correlation_within(const Observations& observations, const std::vector<int>& rows) {
  for (const auto& [block, own] : rows_of_each(observations.block, rows))
    for (std::size_t k = 1; k < own.size(); ++k)
      for (int between = own[k - 1] + 1; between < own[k]; ++between)
        if (observations.block[static_cast<std::size_t>(between)] == block) return 0;
  return observations.scatter.run_correlation[0];
}

}  // namespace

bool are_within_bounds(const std::vector<GroupEstimate>& groups, const EffectParameter& amplitude) {
  constexpr std::size_t kOneOf = 20;
  const auto outside = std::ranges::count_if(groups, [&](const GroupEstimate& group) {
    return group.low > amplitude.upper || group.high < amplitude.lower;
  });
  return static_cast<std::size_t>(outside) * kOneOf <= groups.size();
}

double likelihood_beside_own(const Observations& observations, const NullFit& fit,
                             const std::vector<int>& rows) {
  double log_size = 0;
  for (const auto& [group, own] : rows_of_each(observations.group, rows)) {
    const Eigen::ColPivHouseholderQR<MatrixXd> qr(observations.baseline_columns(own));
    log_size += qr.matrixR().diagonal().head(qr.rank()).array().abs().log().sum();
  }
  return fit.log_likelihood + log_size;
}

VectorXd values_by_group(const Observations& observations, const std::vector<GroupEstimate>& estimates) {
  std::map<std::string_view, double> value;
  for (const GroupEstimate& estimate : estimates) value[estimate.group] = estimate.value;
  VectorXd result = VectorXd::Zero(observations.groups());
  for (int group = 0; group < observations.groups(); ++group)
    if (const auto of = value.find(observations.group_name[static_cast<std::size_t>(group)]);
        of != value.end())
      result(group) = of->second;
  return result;
}

OwnResponse respond_in_groups(const Term& term, const VectorXd& amplitude, const Observations& observations,
                              const MatrixXd& forces) {
  const TermResponse response = respond(term, VectorXd(amplitude(observations.group)), observations, forces);
  return {response.value[0].col(0), response.derivative[0][0].col(0)};
}

GroupTerm group_term(const Observations& observations, const JointFit& fit, const Forces& forces,
                     std::size_t t, const std::vector<int>& rows) {
  const Index k = place_among_own(fit.model, t);
  GroupTerm result{
      .by_group = amplitudes_of(observations, fit, t, rows), .amplitude = {}, .made = {}, .acted_on = {}};
  result.amplitude = result.by_group(observations.group);
  result.made = result.amplitude.cwiseProduct(observations.slopes.col(observations.first_own_slope() + k)) +
                observations.beyond.col(k);
  const VectorXd with_it = forces.acted_on[t].col(0);  // a part of the baseline
  result.acted_on = observations.multiplicative ? VectorXd(with_it.array() / result.made.array().exp())
                                                : VectorXd(with_it - result.made);
  return result;
}

Index place_among_own(const MeanModel& model, std::size_t t) {
  return std::count_if(model.terms.begin(), model.terms.begin() + static_cast<std::ptrdiff_t>(t),
                       [](const Term& term) { return term.per_group; });
}

Observations without_own(const Observations& observations, const MeanModel& model, std::size_t t) {
  const auto without = [](const MatrixXd& columns, Index column) {
    MatrixXd result(columns.rows(), columns.cols() - 1);
    result << columns.leftCols(column), columns.rightCols(columns.cols() - column - 1);
    return result;
  };
  const Index k = place_among_own(model, t);
  Observations fewer = observations;
  fewer.slopes = without(observations.slopes, observations.first_own_slope() + k);
  fewer.beyond = without(observations.beyond, k);
  return fewer;
}

std::vector<int> groups_among(const Observations& observations, const std::vector<int>& rows) {
  std::vector<int> groups;
  for (const auto& [group, own] : rows_of_each(observations.group, rows)) groups.push_back(group);
  return groups;
}

std::vector<Components> columns_by_group(const Components& column, const Observations& observations,
                                         const std::vector<int>& groups, const MixedModel& mixed) {
  std::vector<Components> result;
  for (const int group : groups) {
    Components own = column;
    for (Index row = 0; row < observations.rows(); ++row)
      if (observations.group[static_cast<std::size_t>(row)] != group)
        for (MatrixXd& component : own) component.row(row).setZero();
    if (mixed.sees(own)) result.push_back(std::move(own));
  }
  return result;
}

JointFit fit_with_parameter(std::size_t k, double value, Observations& observations, MeanModel model,
                            std::size_t t, const std::vector<int>& rows) {
  const MatrixXd predicted = predict_response(observations, model, rows);
  model.terms[t].parameters[k] = value;
  const Index own = place_among_own(model, t);
  observations.slopes.col(observations.first_own_slope() + own) =
      respond(model.terms[t], observations, predicted).derivative[0][0];
  observations.beyond.col(own).setZero();
  return fit_in_turns(observations, model, rows);
}

JointFit fit_in_turns(Observations& observations, const MeanModel& model, const std::vector<int>& rows) {
  constexpr int kMostTurns = 10;
  constexpr double kSettled = 1e-4;  // of what the effect does
  JointFit fit = fit_jointly(observations, model, rows);
  const Index first = observations.first_own_slope();
  bool settled = false;
  for (int turn = 0; turn < kMostTurns && !settled; ++turn) {
    const Forces forces = predict_forces(observations, fit.model, rows);
    MatrixXd slopes = observations.slopes, beyond = observations.beyond;
    settled = true;
    for (std::size_t t = 0; t < fit.model.terms.size(); ++t) {
      if (!fit.model.terms[t].per_group) continue;
      const Index k = place_among_own(fit.model, t);
      const GroupTerm before = group_term(observations, fit, forces, t, rows);
      const OwnResponse own =
          respond_in_groups(fit.model.terms[t], before.by_group, observations, before.acted_on);
      slopes.col(first + k) = own.derivative;
      beyond.col(k) = own.beyond(before.amplitude);
      settled &= (own.value - before.made).norm() <= kSettled * own.value.norm();
    }
    if (!slopes.allFinite() || !beyond.allFinite()) break;  // a force that has changed its sign
    observations.slopes = std::move(slopes);
    observations.beyond = std::move(beyond);
    fit = fit_jointly(observations, fit.model, rows);
  }
  return fit;
}

std::vector<GroupEstimate> estimate_by_group(const Observations& observations, const MeanModel& model,
                                             std::size_t t, const NullFit& variances,
                                             const std::vector<int>& rows) {
  const Index column = observations.first_own_slope() + place_among_own(model, t);
  const LinearModel linear = linearise(observations, model, predict_forces(observations, model, rows));
  const Components y = difference(response_components(observations), linear.offset);
  const VectorXd left_of_y = left_beside(observations, y, linear.columns, variances, rows)[0].col(0);
  std::vector<GroupEstimate> result;
  for (const auto& [group, own] : rows_of_each(observations.group, rows)) {
    const Index n = static_cast<Index>(own.size()), k = observations.slopes.cols();
    MatrixXd items(n, k + 2);  // constant and other columns, then x and y
    items << observations.baseline_columns(own), left_of_y(own);
    items.col(1 + column).swap(items.col(k));
    whiten(without_numbers(places_of_each(observations.block, own)), observations.scatter.of_runs(own),
           kRatios[variances.ratio[0]], correlation_within(observations, own), items);
    // What the group's other columns make of both is no part of the amplitude (Frisch & Waugh 1933).
    const MatrixXd others = items.leftCols(k);
    const Eigen::CompleteOrthogonalDecomposition<MatrixXd> solver(others);
    const MatrixXd left = items.rightCols(2) - others * solver.solve(items.rightCols(2));
    const VectorXd seen = left.col(0), rest = left.col(1);
    const Index dof = n - 1 - solver.rank();
    if (dof < 1 || !(seen.norm() > kLeastSeen * items.col(k).norm())) continue;
    const double amplitude = seen.dot(rest) / seen.squaredNorm();
    const double variance = (rest - amplitude * seen).squaredNorm() / static_cast<double>(dof);
    const double half = half_width_95(std::sqrt(variance / seen.squaredNorm()), static_cast<double>(dof));
    result.push_back({observations.group_name[static_cast<std::size_t>(group)], amplitude, amplitude - half,
                      amplitude + half});
  }
  return result;
}

}  // namespace tunnelrig
