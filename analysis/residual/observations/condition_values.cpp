#include "analysis/residual/observations/condition_values.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <set>

namespace tunnelrig {

using Eigen::Index;
using Eigen::MatrixXd;

/// A value of few is told apart if as many blocks have it as a step needs on either side.
constexpr std::size_t kBlocksPerLevel = 3, kMostLevels = 12;

namespace {

/// Of one rotor, or of all (−1).
std::set<double> values_of(const Covariate& covariate, const std::vector<int>& rows, int rotor) {
  std::set<double> values;
  for (const int row : rows)
    for (Index c = 0; c < covariate.value.cols(); ++c)
      if (rotor < 0 || c == rotor || !covariate.per_channel()) values.insert(covariate.value(row, c));
  return values;
}

/// Over runs and rotors, from the mean.
Eigen::VectorXd deviations(const Covariate& covariate, Index channels) {
  const MatrixXd all = covariate.value.replicate(1, channels / covariate.value.cols());
  return all.reshaped().array() - all.mean();
}

}  // namespace

double correlation(const Covariate& first, const Covariate& second) {
  const Index channels = std::max(first.value.cols(), second.value.cols());
  const Eigen::VectorXd u = deviations(first, channels), v = deviations(second, channels);
  const double norms = u.norm() * v.norm();
  return norms > 0 ? u.dot(v) / norms : 0;
}

double rank_correlation(const Covariate& first, const Covariate& second) {
  const auto ranked = [](Covariate covariate) {
    for (Index c = 0; c < covariate.value.cols(); ++c) {
      std::vector<double> sorted(covariate.value.col(c).begin(), covariate.value.col(c).end());
      std::ranges::sort(sorted);
      for (double& x : covariate.value.col(c)) {
        const auto [from, to] = std::equal_range(sorted.begin(), sorted.end(), x);
        x = static_cast<double>((from - sorted.begin()) + (to - sorted.begin()));
      }
    }
    return covariate;
  };
  return correlation(ranked(first), ranked(second));
}

const Covariate* number_of_texts(const Observations& observations, const Covariate& texts) {
  if (texts.labels.empty()) return nullptr;
  for (const Covariate& number : observations.covariates) {
    if (!number.labels.empty() || number.derived || number.per_channel() ||
        !can_be_followed(observations, number))
      continue;
    std::map<double, double> of_text, of_number;
    bool one_to_one = true;
    for (Index row = 0; row < observations.rows() && one_to_one; ++row) {
      const double text = texts.value(row, 0), value = number.value(row, 0);
      one_to_one = of_text.emplace(text, value).first->second == value &&
                   of_number.emplace(value, text).first->second == text;
    }
    if (one_to_one) return &number;
  }
  return nullptr;
}

bool can_be_followed(const Observations& observations, const Covariate& covariate) {
  return !observations.not_usable.contains(covariate.name) && covariate.value.allFinite() &&
         !is_constant(covariate);
}

bool is_constant(const Covariate& covariate) {
  constexpr double kRounding = 1e-9;  // of the values: a range that is no more is none
  const auto value = covariate.value.reshaped();
  const Index known = value.array().isFinite().count();
  if (known < value.size() && known > 0 && may_be_absent(covariate.name)) return false;
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const double each : value) {
    if (!std::isfinite(each)) continue;
    low = std::min(low, each);
    high = std::max(high, each);
  }
  return known == 0 || high - low <= kRounding * std::max(std::abs(low), std::abs(high));
}

double share_beside_cubics(const Observations& observations, const std::vector<int>& rows,
                           const std::vector<Eigen::VectorXd>& conditions, const Eigen::VectorXd& column) {
  constexpr int kDegree = 3;
  MatrixXd columns(column.size(), kDegree * static_cast<Index>(conditions.size()) + 1);
  Index next = 0;
  for (const Eigen::VectorXd& condition : conditions) {
    const Eigen::ArrayXd x = condition.array() - condition.mean();
    for (int power = 1; power <= kDegree; ++power) columns.col(next++) = (x / x.abs().maxCoeff()).pow(power);
  }
  columns.col(next) = column;
  for (const auto& [group, members] : places_of_each(observations.group, rows)) {
    const MatrixXd own = columns(members, Eigen::all);
    columns(members, Eigen::all) = own.rowwise() - own.colwise().mean();
  }
  const MatrixXd cubics = columns.leftCols(next);
  const Eigen::VectorXd whole = columns.col(next);
  const Eigen::VectorXd left = whole - cubics * cubics.completeOrthogonalDecomposition().solve(whole);
  return whole.squaredNorm() > 0 ? left.squaredNorm() / whole.squaredNorm() : 0;
}

bool all_but_tells(const Observations& observations, const std::vector<int>& rows,
                   const Eigen::VectorXd& condition, const Eigen::VectorXd& other) {
  constexpr double kLittle = 0.02;  // of its variance
  return share_beside_cubics(observations, rows, {condition(rows)}, other(rows)) < kLittle;
}

int places_on_range(const Covariate& covariate, const std::vector<int>& rows, int rotor) {
  constexpr double kApart = 0.01;
  const std::set<double> values = values_of(covariate, rows, rotor);
  const double range = *values.rbegin() - *values.begin();
  int count = 0;
  auto next = values.begin();
  while (next != values.end()) {
    ++count;
    const auto apart = values.lower_bound(*next + kApart * range);
    next = apart == next ? std::next(next) : apart;
  }
  return count;
}

int different_values(const Covariate& covariate, const std::vector<int>& rows) {
  std::set<double> values;
  for (const int row : rows) values.insert(covariate.value(row, 0));
  return static_cast<int>(values.size());
}

std::vector<double> levels_of(const Observations& observations, const Covariate& covariate,
                              const std::vector<int>& rows) {
  struct Level {
    std::size_t rows = 0;
    std::set<int> blocks;
  };
  if (covariate.derived || covariate.per_channel()) return {};
  std::map<double, Level> all;
  for (const int row : rows) {
    Level& level = all[covariate.value(row, 0)];
    ++level.rows;
    level.blocks.insert(observations.block[static_cast<std::size_t>(row)]);
  }
  std::vector<double> levels;
  std::size_t held = 0;
  for (const auto& [value, level] : all) {
    if (level.blocks.size() < kBlocksPerLevel) continue;
    levels.push_back(value);
    held += level.rows;
  }
  if (levels.size() < 2 || levels.size() > kMostLevels || 10 * held < 9 * rows.size()) return {};
  std::iter_swap(levels.begin(), std::max_element(levels.begin(), levels.end(), [&](double a, double b) {
                   return all[a].rows < all[b].rows;
                 }));
  return levels;
}

double widest_gap(const Covariate& covariate, const std::vector<int>& rows, int rotor) {
  const std::set<double> values = values_of(covariate, rows, rotor);
  double gap = 0;
  for (auto next = std::next(values.begin()); next != values.end(); ++next)
    gap = std::max(gap, *next - *std::prev(next));
  return gap / (*values.rbegin() - *values.begin());
}

}  // namespace tunnelrig
