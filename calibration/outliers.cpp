#include "calibration/outliers.h"

#include "calibration/distributions.h"
#include "calibration/regression.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <random>

#include <Eigen/QR>

namespace tunnelrig {
namespace {

using Mask = Eigen::Array<bool, Eigen::Dynamic, 1>;
using Rows = std::vector<Eigen::Index>;

// With a quarter of the rows gross, every one of 150 draws of 8 rows holds such a row with p = (1 −
// 0.75⁸)¹⁵⁰, 2e-7.
constexpr int kStarts = 150;

double log_binomial(double n, double k) {
  return std::lgamma(n + 1) - std::lgamma(k + 1) - std::lgamma(n - k + 1);
}

std::optional<Eigen::VectorXd> solve_rows(const Eigen::MatrixXd& X, const Eigen::VectorXd& y,
                                          const Rows& rows) {
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(X(rows, Eigen::all));
  if (qr.rank() < X.cols()) return {};
  return qr.solve(y(rows));
}

/// Rows by the size of their residuals, smallest first.
Rows by_residual(const Eigen::MatrixXd& X, const Eigen::VectorXd& y, const Eigen::VectorXd& coefficients) {
  const Eigen::VectorXd distance = (y - X * coefficients).cwiseAbs();
  Rows order(static_cast<std::size_t>(X.rows()));
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](Eigen::Index a, Eigen::Index b) { return distance[a] < distance[b]; });
  return order;
}

/// Orders of rows whose first few determine the coefficients: every set of p rows where they are few, random
/// orders otherwise.
std::vector<Rows> starting_orders(Eigen::Index n, Eigen::Index p) {
  std::vector<Rows> orders;
  if (log_binomial(static_cast<double>(n), static_cast<double>(p)) < std::log(kStarts)) {
    std::vector<bool> chosen(static_cast<std::size_t>(n), false);
    std::fill_n(chosen.begin(), p, true);
    do {
      Rows& order = orders.emplace_back();
      for (Eigen::Index i = 0; i < n; ++i) {
        if (chosen[static_cast<std::size_t>(i)]) order.push_back(i);
      }
    } while (std::prev_permutation(chosen.begin(), chosen.end()));
    return orders;
  }
  std::mt19937 engine(20051984);  // fixed: the same points give the same certificate
  Rows order(static_cast<std::size_t>(n));
  std::iota(order.begin(), order.end(), 0);
  for (int i = 0; i < kStarts; ++i) {
    std::shuffle(order.begin(), order.end(), engine);
    orders.push_back(order);
  }
  return orders;
}

/// The first rows in that order that do not depend on those before them (Gram and Schmidt): p of them where X
/// has its full rank.
Rows independent_rows(const Eigen::MatrixXd& X, const Rows& order) {
  Rows chosen;
  Eigen::MatrixXd basis(X.cols(), X.cols());
  for (const Eigen::Index row : order) {
    const auto rank = static_cast<Eigen::Index>(chosen.size());
    if (rank == X.cols()) break;
    const Eigen::VectorXd known = basis.leftCols(rank).transpose() * X.row(row).transpose();
    const Eigen::VectorXd rest = X.row(row).transpose() - basis.leftCols(rank) * known;
    if (rest.norm() <= 1e-8 * X.row(row).norm()) continue;
    basis.col(rank) = rest.normalized();
    chosen.push_back(row);
  }
  return chosen;
}

/// A set of rows taken out, and the fit of the rest.
struct Deletion {
  Rows rows;
  std::optional<Regression> rest;

  Deletion(const Eigen::MatrixXd& X, const Eigen::VectorXd& y, Rows removed) : rows(std::move(removed)) {
    Mask keep = Mask::Constant(X.rows(), true);
    for (const Eigen::Index row : rows) keep[row] = false;
    rest = regress(rows_where(X, keep), rows_where(y, keep));
  }

  double rest_sum() const { return rest ? rest->residual_sum : std::numeric_limits<double>::infinity(); }
};

/// Test of the rows against one deletion.
class Tester {
 public:
  Tester(const Eigen::MatrixXd& X, const Eigen::VectorXd& y)
      : X_(X), y_(y), all_(*regress(X, y)), least_variance_(std::pow(rounding_floor(y), 2)) {}

  /// P of the joint mean-shift F test, times the number of sets of that size.
  double joint_p(const Deletion& deletion) const {
    const auto k = static_cast<double>(deletion.rows.size());
    const int dof = deletion.rest->dof;
    const double excess = (all_.residual_sum - deletion.rest->residual_sum) / k;
    const double f = excess / std::max(deletion.rest->variance(), least_variance_);
    return f_upper_p(std::max(f, 0.0), k, dof) * std::exp(log_binomial(static_cast<double>(X_.rows()), k));
  }

  std::vector<RowTest> rows(const Deletion& deletion) const {
    const Regression& rest = *deletion.rest;
    std::vector<RowTest> tests(static_cast<std::size_t>(X_.rows()));
    for (Eigen::Index i = 0; i < X_.rows(); ++i) {
      const bool removed = std::find(deletion.rows.begin(), deletion.rows.end(), i) != deletion.rows.end();
      const double h = X_.row(i) * rest.inverse_normal * X_.row(i).transpose();
      const double residual = y_[i] - X_.row(i) * rest.coefficients;
      RowTest& test = tests[static_cast<std::size_t>(i)];
      test.leverage = removed ? h / (1 + h) : std::min(h, 1.0);
      test.gross = removed;
      // a removed row is out of the rest's scatter already, another one is taken out of it here
      const double spread = removed ? 1 + h : 1 - h;
      const int dof = removed ? rest.dof : rest.dof - 1;
      if (dof < 1 || spread < 1e-10) continue;
      const double sum = removed ? rest.residual_sum : rest.residual_sum - residual * residual / spread;
      const double variance = std::max(sum / dof, least_variance_);
      test.studentised = residual / std::sqrt(variance * spread);
      test.p = std::min(1.0, static_cast<double>(X_.rows()) * student_t_two_sided_p(test.studentised, dof));
    }
    return tests;
  }

  /// Whether the set as a whole and each of its members is gross.
  bool keeps(const GrossRule& rule, const Deletion& deletion) const {
    if (!deletion.rest || joint_p(deletion) > rule.p) return false;
    const auto tests = rows(deletion);
    const Eigen::VectorXd fitted = X_ * deletion.rest->coefficients;
    const double least = rule.share_of_span * (fitted.maxCoeff() - fitted.minCoeff());
    return std::all_of(deletion.rows.begin(), deletion.rows.end(), [&](Eigen::Index row) {
      return tests[static_cast<std::size_t>(row)].p <= rule.p && std::abs(y_[row] - fitted[row]) >= least;
    });
  }

  /// The row whose deletion residual is largest among those that `deletion` leaves.
  Eigen::Index most_extreme(const Deletion& deletion) const {
    const auto tests = rows(deletion);
    const auto size_of = [](const RowTest& test) { return test.gross ? -1.0 : std::abs(test.studentised); };
    const auto found = std::max_element(tests.begin(), tests.end(), [&](const RowTest& a, const RowTest& b) {
      return size_of(a) < size_of(b);
    });
    return found - tests.begin();
  }

 private:
  const Eigen::MatrixXd& X_;
  const Eigen::VectorXd& y_;
  Regression all_;
  double least_variance_;
};

/// Candidate sets of 1 to `largest` rows: the stepwise one and the robust one of each size, whichever leaves
/// less scatter.
std::vector<Deletion> candidate_sets(const Eigen::MatrixXd& X, const Eigen::VectorXd& y, const Tester& tester,
                                     Eigen::Index largest) {
  const Rows robust = by_residual(X, y, least_trimmed_squares(X, y));
  std::vector<Deletion> sets;
  Deletion stepwise(X, y, {});
  for (Eigen::Index size = 1; size <= largest; ++size) {
    Deletion trimmed(X, y, Rows(robust.end() - size, robust.end()));
    if (stepwise.rest) {
      Rows grown = stepwise.rows;
      grown.push_back(tester.most_extreme(stepwise));
      stepwise = Deletion(X, y, std::move(grown));
    }
    sets.push_back(stepwise.rest_sum() < trimmed.rest_sum() ? stepwise : std::move(trimmed));
  }
  return sets;
}

}  // namespace

Eigen::VectorXd least_trimmed_squares(const Eigen::MatrixXd& X, const Eigen::VectorXd& y) {
  const Eigen::VectorXd scale = X.colwise().norm();
  const Eigen::MatrixXd scaled = X * scale.cwiseInverse().asDiagonal();
  const auto half = static_cast<std::ptrdiff_t>((X.rows() + X.cols() + 1) / 2);
  const auto concentrated = [&](const Eigen::VectorXd& start) {
    const Rows order = by_residual(scaled, y, start);
    return Rows(order.begin(), order.begin() + half);
  };
  Eigen::VectorXd best = scaled.colPivHouseholderQr().solve(y);
  double least = std::numeric_limits<double>::infinity();
  for (const Rows& order : starting_orders(X.rows(), X.cols())) {
    auto found = solve_rows(scaled, y, independent_rows(scaled, order));
    for (int step = 0; found && step < 2; ++step) found = solve_rows(scaled, y, concentrated(*found));
    if (!found) continue;
    const Rows kept = concentrated(*found);
    const double sum = (y(kept) - scaled(kept, Eigen::all) * *found).squaredNorm();
    if (sum < least) {
      least = sum;
      best = *found;
    }
  }
  return best.cwiseQuotient(scale);
}

std::vector<RowTest> test_rows(const Eigen::MatrixXd& X, const Eigen::VectorXd& y, const GrossRule& rule) {
  const auto all = regress(X, y);
  if (!all || all->dof < 2) {
    std::vector<RowTest> untested(static_cast<std::size_t>(X.rows()));
    for (std::size_t i = 0; all && i < untested.size(); ++i) {
      untested[i].leverage = all->leverage[static_cast<Eigen::Index>(i)];
    }
    return untested;
  }
  const Tester tester(X, y);
  const Eigen::Index largest =
      std::min((X.rows() - X.cols() - 1) / 2, std::max<Eigen::Index>(1, X.rows() / 4));
  const auto sets = candidate_sets(X, y, tester, largest);
  const auto gross =
      std::find_if(sets.rbegin(), sets.rend(), [&](const Deletion& set) { return tester.keeps(rule, set); });
  return tester.rows(gross == sets.rend() ? Deletion(X, y, {}) : *gross);
}

}  // namespace tunnelrig
