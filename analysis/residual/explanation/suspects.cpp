// Rows that do not belong to the others.
#include "analysis/residual/explanation/explanation_parts.h"
#include "analysis/residual/likelihood/scores.h"
#include "analysis/upper_median.h"
#include "calibration/distributions.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>

#include <fmt/format.h>

namespace tunnelrig {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

double degrees_of_freedom(const Observations& observations, const JointFit& fit,
                          const std::vector<int>& rows) {
  const MixedModel mixed(observations, rows, fit.variances.ratio);
  Index dof = -static_cast<Index>(fit.linear.columns.size());
  for (std::size_t s = 0; s < mixed.strata().size(); ++s)
    if (mixed.strata()[s].means()) dof += mixed.dof(s);
  return static_cast<double>(std::max<Index>(dof, 2));
}

int place_of(const Observations& observations, const std::string& row) {
  return static_cast<int>(std::ranges::find(observations.name, row) - observations.name.begin());
}

double sigma_by_median(const VectorXd& sizes) {
  constexpr double kMedianOfNormal = 0.6745;
  std::vector<double> deviations(sizes.begin(), sizes.end());
  std::erase(deviations, 0.0);
  return deviations.empty() ? 0 : upper_median(std::move(deviations)) / kMedianOfNormal;
}

namespace {

/// Of each run and rotor, in y: its own, and what it has in common with the others.
MatrixXd variance_of_runs(const Observations& observations, const NullFit& variances,
                          const std::vector<int>& rows) {
  const MixedModel mixed = MixedModel::baseline_alone(observations, rows);
  const VectorXd scatter = observations.scatter.of_runs(rows);
  MatrixXd result = MatrixXd::Zero(scatter.size(), observations.channels());
  for (std::size_t s = 0; s < mixed.strata().size(); ++s) {
    const MixedModel::Stratum& stratum = mixed.strata()[s];
    if (!stratum.means()) continue;
    const VectorXd variance =
        std::pow(variances.sigma[s], 2) * (scatter.array().square() + kRatios[variances.ratio[s]]);
    result += variance *
              mixed.rotors_of_modes().middleRows(stratum.first_mode, stratum.modes).colwise().squaredNorm();
  }
  return result;
}

/// σ. A campaign has some 1,700 values that are not typed by hand. Of Student's t with three degrees of
/// freedom one of 2,300 lies beyond 10 of its standard deviations, one of 19,000 beyond 20. That the k
/// farthest are all twice as far as the next has the chance 2^(−3k) in such tails: of several that are apart
/// it says enough.
double gross_beyond(const Observations& observations, std::size_t together = 1) {
  return observations.from_table || together > 1 ? 10 : 20;
}

/// Several gross rows hide each other in the variance: of n rows, k alike are hardly beyond √(n/k) of it. But
/// they lie apart. Residuals of rows (of a campaign's runs, what is common to the rotors), each from its
/// group's median, in σ by the median size of all, where these are the farthest (at most one of ten): beyond
/// what is gross, and twice as far as the next; 0 elsewhere. The tails of a distribution, or of a group that
/// scatters more, have no such gap.
VectorXd distance_of_those_apart(const Observations& observations, const std::vector<int>& rows,
                                 const VectorXd& residual) {
  constexpr double kGap = 2;
  constexpr std::size_t kFewestOfGroup = 5;
  VectorXd away = VectorXd::Zero(residual.size());
  for (auto& [group, members] : places_of_each(observations.group, rows)) {
    std::erase_if(members, [&](Index r) { return !std::isfinite(residual(r)); });
    if (members.empty()) continue;
    const VectorXd own = residual(members);
    away(members) =
        own.array() - (members.size() < kFewestOfGroup ? 0 : upper_median({own.begin(), own.end()}));
  }
  const VectorXd size = away.cwiseAbs();
  const double sigma = sigma_by_median(size);
  std::vector<double> sorted(size.begin(), size.end());
  std::sort(sorted.begin(), sorted.end(), std::greater<>());
  for (std::size_t k = sorted.size() / kRowsPerGross; sigma > 0 && k > 0; --k)
    if (sorted[k - 1] > gross_beyond(observations, k) * sigma && sorted[k - 1] >= kGap * sorted[k])
      return (size.array() >= sorted[k - 1]).select(away / sigma, 0);
  return VectorXd::Zero(residual.size());
}

/// What was predicted, where the model is of logarithms; what is known, where it is not.
MatrixXd scale_of_residuals(const Observations& observations, const HeldOutErrors& errors) {
  if (!observations.multiplicative) return observations.known(errors.rows, Eigen::all);
  return (observations.value(errors.rows, Eigen::all) + errors.error).cwiseAbs();
}

/// On the scale of the model, where residuals are normal: of a tenth and of ten times alike.
MatrixXd residuals_of(const Observations& observations, const HeldOutErrors& errors) {
  if (!observations.multiplicative)
    return -errors.error.cwiseQuotient(scale_of_residuals(observations, errors));
  return (observations.value(errors.rows, Eigen::all).array().abs() /
          scale_of_residuals(observations, errors).array())
      .log();
}

/// Of each run, what all rotors have in common (of a table's row its response) beside its group's median.
VectorXd from_group_medians(const Observations& observations) {
  VectorXd away = observations.y.rowwise().mean();
  for (const auto& [group, runs] : places_of_each(observations.group)) {
    const VectorXd own = away(runs);
    away(runs).array() -= upper_median({own.begin(), own.end()});
  }
  return away;
}

/// 1 − h: of each row's own error, of variance `sigma2`, what the fit to all has left.
MatrixXd share_left(const Observations& observations, const HeldOutErrors& errors, const MatrixXd& sigma2) {
  constexpr double kLeast = 0.02;
  const MatrixXd unit = scale_of_residuals(observations, errors);
  return (2 - (errors.expected_std.array() / unit.array()).square() / sigma2.array()).cwiseMax(kLeast);
}

}  // namespace

bool is_beyond_a_curve(const MeanModel& model, int row) {
  return std::ranges::any_of(model.curves, [&](const Curve& curve) {
    if (curve.x.size() == 0 || curve.shape == CurveShape::kLevels) return false;
    const auto x = curve.x.row(row).array();
    return (x < curve.low || x > curve.high).any();
  });
}

std::vector<SuspectRow> apart_from_their_block(const Observations& observations, const MeanModel& model,
                                               const HeldOutErrors& sealed) {
  constexpr Index kOthersOfBlock = 4;  // to each that is apart
  if (observations.blocks_are_rows || !observations.held_out.empty()) return {};
  VectorXd residual = residuals_of(observations, sealed).rowwise().mean();
  for (Index r = 0; r < residual.size(); ++r)
    if (is_beyond_a_curve(model, sealed.rows[static_cast<std::size_t>(r)]))
      residual(r) = std::numeric_limits<double>::quiet_NaN();
  const VectorXd apart = distance_of_those_apart(observations, sealed.rows, residual);
  std::vector<SuspectRow> result;
  for (const auto& [block, rows] : places_of_each(observations.block, sealed.rows)) {
    const VectorXd own = apart(rows);
    const Index gross = (own.array() != 0).count();
    if (gross * (1 + kOthersOfBlock) > own.size()) continue;
    for (const Index r : rows)
      if (apart(r) != 0)
        result.push_back(
            {.row = observations.name[static_cast<std::size_t>(sealed.rows[static_cast<std::size_t>(r)])],
             .studentised = apart(r),
             .apart = true});
  }
  return result;
}

std::vector<SuspectRow> suspect_rows(const Observations& observations, const HeldOutErrors& errors,
                                     const NullFit& variances, double dof) {
  const MatrixXd sigma2 = variance_of_runs(observations, variances, errors.rows);
  MatrixXd residual = residuals_of(observations, errors);
  const MatrixXd left = share_left(observations, errors, sigma2);
  VectorXd apart = distance_of_those_apart(observations, errors.rows, residual.rowwise().mean());
  residual.array() /= sigma2.array().sqrt();
  // A gross row under a rare condition may have been taken for scatter that goes with it, and others for
  // none.
  if (apart.isZero(0)) apart = distance_of_those_apart(observations, errors.rows, residual.rowwise().mean());
  const auto missing = residual.array().isNaN();
  const double variance = missing.select(0, residual).squaredNorm() / missing.select(0, left).sum();
  const double limit = student_t_quantile(
      1 - 0.005 / static_cast<double>(std::max<Index>(1, residual.size())), std::max(dof - 1, 1.0));
  std::vector<SuspectRow> result;
  for (Index r = 0; r < residual.rows(); ++r) {
    // A run in which all rotors are off is left out with all of them, or each would hide the others.
    std::vector<double> inner;
    double squares = 0;
    for (Index c = 0; c < residual.cols(); ++c) {
      if (std::isnan(residual(r, c)) || !(variance > 0)) continue;
      inner.push_back(residual(r, c) / std::sqrt(variance * left(r, c)));
      squares += inner.back() * inner.back();
    }
    const double own = static_cast<double>(inner.size());
    const double scale = std::sqrt(std::max(dof - own, 1.0) / std::max(dof - squares, 1.0));
    double worst = apart(r);
    for (const double of_rotor : inner)
      if (std::abs(scale * of_rotor) > std::abs(worst)) worst = scale * of_rotor;
    if (std::abs(worst) > limit)
      result.push_back(
          {.row = observations.name[static_cast<std::size_t>(errors.rows[static_cast<std::size_t>(r)])],
           .studentised = worst,
           .apart = apart(r) != 0});
  }
  std::sort(result.begin(), result.end(), [](const SuspectRow& a, const SuspectRow& b) {
    return std::abs(a.studentised) > std::abs(b.studentised);
  });
  return result;
}

std::vector<std::string> blocks_apart(const Observations& observations) {
  constexpr double kFar = 20, kLeastFactor = 2;
  constexpr std::size_t kBlocks = 6, kRows = 3;  // at least
  if (!observations.from_table || observations.blocks_are_rows || observations.groups_within_blocks ||
      !observations.multiplicative)
    return {};
  const VectorXd away = from_group_medians(observations);
  const double sigma = sigma_by_median(away.cwiseAbs());
  std::vector<std::string> result;
  const auto blocks = places_of_each(observations.block);
  for (const auto& [block, rows] : blocks) {
    const VectorXd own = away(rows);
    const double middle = upper_median({own.begin(), own.end()});
    if (blocks.size() < kBlocks || rows.size() < kRows || !(sigma > 0) ||
        std::abs(middle) < std::max(kFar * sigma, std::log(kLeastFactor)))
      continue;
    result.push_back(fmt::format("{} of block {} is {:.3g} times what the others let expect: another unit?",
                                 observations.response,
                                 observations.block_name[static_cast<std::size_t>(block)], std::exp(middle)));
  }
  return result;
}

std::optional<SuspectRow> lone_row(const Observations& observations) {
  constexpr double kFewest = 8;
  const std::vector<int> rows = observations.all_rows();
  if (!observations.from_table || !observations.other_axes.empty()) return {};
  const JointFit baseline = fit_jointly(observations, {}, rows);
  const double dof = degrees_of_freedom(observations, baseline, rows);
  if (dof < kFewest) return {};
  const HeldOutErrors fitted = score(observations, baseline, rows, rows);
  const MatrixXd left =
      share_left(observations, fitted, variance_of_runs(observations, baseline.variances, rows));
  const VectorXd apart = distance_of_those_apart(
      observations, rows, residuals_of(observations, fitted).cwiseQuotient(left).rowwise().mean());
  Index row = 0;
  if ((apart.array() != 0).count() != 1) return {};
  apart.cwiseAbs().maxCoeff(&row);
  return SuspectRow{.row = observations.name[static_cast<std::size_t>(row)], .studentised = apart(row)};
}

std::optional<SuspectRow> gross_row(const Observations& observations) {
  constexpr double kGross = 6, kFewestLeft = 6;
  if (!observations.blocks_are_rows || observations.other_axes.empty()) return {};
  const std::vector<int> rows = observations.all_rows();
  std::vector<Components> columns;
  for (const std::string& axis : observations.other_axes) columns.push_back({observations.find(axis)->value});
  const Components y = response_components(observations);
  JointFit fit;
  fit.linear.columns = columns;
  fit.variances = CandidateScan(MixedModel(observations, rows), columns, {}).null_fit(y);
  const double dof = degrees_of_freedom(observations, fit, rows);
  if (dof < kFewestLeft) return {};
  const HeldOutErrors errors = predict_held_out(observations, y, columns, fit.variances, rows, rows);
  const std::vector<SuspectRow> suspects = suspect_rows(observations, errors, fit.variances, dof);
  if (suspects.empty() || std::abs(suspects[0].studentised) < kGross) return {};
  return suspects[0];
}

std::vector<SuspectRow> wild_runs(const Observations& observations) {
  // Of Student's t with three degrees of freedom one of 18,000 lies beyond this.
  constexpr double kWild = 30;
  constexpr std::size_t kFewest = 3;  // of two runs or rotors, nothing says which is wrong
  if (static_cast<std::size_t>(observations.channels()) < kFewest) return {};
  MatrixXd away = observations.y;
  for (const auto& [group, runs] : places_of_each(observations.group))
    for (Index c = 0; c < away.cols(); ++c) {
      const VectorXd y = observations.y(runs, c);
      away(runs, c).array() -= upper_median({y.begin(), y.end()});
      if (runs.size() < kFewest) away(runs, c).setZero();
    }
  for (Index r = 0; r < away.rows(); ++r) {
    const VectorXd rotors = away.row(r);
    away.row(r).array() -= upper_median({rotors.begin(), rotors.end()});
  }
  for (Index c = 0; c < away.cols(); ++c) {
    const VectorXd size = away.col(c).cwiseAbs();
    const double sigma = sigma_by_median(size);
    away.col(c) /= sigma > 0 ? sigma : std::numeric_limits<double>::infinity();
  }
  std::vector<SuspectRow> result;
  for (Index r = 0; r < away.rows(); ++r) {
    Index worst = 0;
    away.row(r).cwiseAbs().maxCoeff(&worst);
    if (std::abs(away(r, worst)) > kWild)
      result.push_back({observations.name[static_cast<std::size_t>(r)], away(r, worst)});
  }
  return result;
}

namespace {

/// Gross rows of a table that share a value of a condition, off to the same side, and that most other rows of
/// that value are like: what they repeat is no slip of the hand.
bool repeat_each_other(const Observations& observations, const SuspectRow& row,
                       const std::vector<SuspectRow>& gross) {
  constexpr double kSame = 0.02;  // of the condition's range
  constexpr std::ptrdiff_t kFewest = 3;
  return std::ranges::any_of(observations.covariates, [&](const Covariate& covariate) {
    if (covariate.derived || covariate.per_channel() || covariate.name == "run_order" ||
        !covariate.value.allFinite())
      return false;
    const double least = kSame * (covariate.value.maxCoeff() - covariate.value.minCoeff());
    const double own = covariate.value(place_of(observations, row.row), 0);
    const auto is_near = [&](double value) { return std::abs(value - own) <= least; };
    const std::ptrdiff_t near = std::ranges::count_if(covariate.value.col(0), is_near);
    const std::ptrdiff_t alike = std::ranges::count_if(gross, [&](const SuspectRow& other) {
      return is_near(covariate.value(place_of(observations, other.row), 0)) &&
             row.studentised * other.studentised > 0;
    });
    return alike >= kFewest && 2 * alike > near && near < observations.rows() / 2;
  });
}

}  // namespace

std::vector<SuspectRow> gross_rows(const Observations& observations,
                                   const std::vector<SuspectRow>& suspects) {
  std::vector<SuspectRow> gross;
  for (const SuspectRow& row : suspects)
    if (row.apart || std::abs(row.studentised) > gross_beyond(observations)) gross.push_back(row);
  std::vector<SuspectRow> result;
  for (const SuspectRow& row : gross)
    if (!observations.from_table || !repeat_each_other(observations, row, gross)) result.push_back(row);
  return result;
}

namespace {

constexpr double kRangesAway = 5;

/// Values further from all others than so many times their range.
std::vector<IsolatedValue> values_beyond(const Observations& observations, double ranges) {
  constexpr Index kFewestRows = 8;
  std::vector<IsolatedValue> result;
  for (const Covariate& covariate : observations.covariates) {
    if (covariate.derived || covariate.per_channel() || !covariate.labels.empty() ||
        observations.not_usable.contains(covariate.name))
      continue;
    const auto at = [&](Index r) { return covariate.value(r, 0); };
    std::vector<Index> order;  // far from ground and ceiling there is no distance
    for (Index r = 0; r < covariate.value.rows(); ++r)
      if (std::isfinite(at(r))) order.push_back(r);
    if (static_cast<Index>(order.size()) < kFewestRows) continue;
    std::sort(order.begin(), order.end(), [&](Index a, Index b) { return at(a) < at(b); });
    const double low = at(order[1]), high = at(order[order.size() - 2]);
    const auto consider = [&](Index row, double from, double to, double gap) {
      if (to > from && gap > ranges * (to - from))
        result.push_back(
            {observations.name[static_cast<std::size_t>(row)], covariate.name, at(row), from, to});
    };
    consider(order.front(), low, at(order.back()), low - at(order.front()));
    consider(order.back(), at(order.front()), high, at(order.back()) - high);
  }
  return result;
}

/// Of each run, how far it is from its location's median, in σ by the median of all.
VectorXd common_distance(const Observations& observations) {
  const VectorXd away = from_group_medians(observations);
  const double sigma = sigma_by_median(away.cwiseAbs());
  return sigma > 0 ? VectorXd(away / sigma) : VectorXd(VectorXd::Zero(away.size()));
}

}  // namespace

std::vector<IsolatedValue> isolated_values(const Observations& observations) {
  return values_beyond(observations, kRangesAway);
}

std::vector<IsolatedValue> mistyped_values(const Observations& observations) {
  constexpr double kARangeAway = 1, kFarOff = 10;
  const VectorXd away = common_distance(observations);
  const auto is_far_off = [&](const IsolatedValue& value) {
    return std::abs(away(place_of(observations, value.row))) > kFarOff;
  };
  std::vector<IsolatedValue> result;
  for (const IsolatedValue& value : isolated_values(observations))
    if (!is_far_off(value)) result.push_back(value);
  for (const IsolatedValue& value : values_beyond(observations, kARangeAway))
    if (value.covariate == "air_temperature_C" && is_far_off(value)) result.push_back(value);
  return result;
}

}  // namespace tunnelrig
