#include "calibration/outliers.h"

#include "calibration/deletions.h"
#include "calibration/distributions.h"
#include "calibration/regression.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <random>
#include <span>
#include <utility>

#include <Eigen/QR>

namespace tunnelrig {
namespace {

using Mask = Eigen::Array<bool, Eigen::Dynamic, 1>;
using Rows = std::vector<Eigen::Index>;
using RemovedRows = std::span<const Eigen::Index>;

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

/// The `count` rows with the smallest residuals, smallest first and the first of equals first.
Rows nearest(const Eigen::MatrixXd& X, const Eigen::VectorXd& y, const Eigen::VectorXd& coefficients,
             Eigen::Index count) {
  const Eigen::VectorXd distance = (y - X * coefficients).cwiseAbs();
  // beside their rows, and only as many as are asked for: sorting is most of the time of a robust fit
  std::vector<std::pair<double, Eigen::Index>> order;
  for (Eigen::Index row = 0; row < X.rows(); ++row) order.emplace_back(distance[row], row);
  std::nth_element(order.begin(), order.begin() + count, order.end());
  std::sort(order.begin(), order.begin() + count);
  Rows rows;
  for (Eigen::Index i = 0; i < count; ++i) rows.push_back(order[static_cast<std::size_t>(i)].second);
  return rows;
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

/// Test of the rows against the fit of the rest without some of them.
class Tester {
 public:
  Tester(const Eigen::MatrixXd& X, const Eigen::VectorXd& y, const Regression& all)
      : X_(X), y_(y), all_sum_(all.residual_sum), least_variance_(std::pow(rounding_floor(y), 2)) {}

  std::vector<RowTest> rows(const RemovedRows& removed, const RestFit& rest) const {
    std::vector<RowTest> tests(static_cast<std::size_t>(X_.rows()));
    for (const Eigen::Index row : removed) tests[static_cast<std::size_t>(row)].gross = true;
    for (Eigen::Index i = 0; i < X_.rows(); ++i) {
      RowTest& test = tests[static_cast<std::size_t>(i)];
      const double h = leverage(rest, i);
      const double residual = y_[i] - X_.row(i) * rest.coefficients;
      test.leverage = test.gross ? h / (1 + h) : std::min(h, 1.0);
      // a removed row is out of the rest's scatter already, another one is taken out of it here
      const double spread = test.gross ? 1 + h : 1 - h;
      const int dof = test.gross ? rest.dof : rest.dof - 1;
      if (dof < 1 || spread < 1e-10) continue;
      const double sum = test.gross ? rest.residual_sum : rest.residual_sum - residual * residual / spread;
      test.studentised = residual / std::sqrt(std::max(sum / dof, least_variance_) * spread);
      test.p = row_p(test.studentised, dof);
    }
    return tests;
  }

  /// Whether the set as a whole and each of its members is gross.
  bool keeps(const GrossRule& rule, const RemovedRows& removed, const RestFit& rest) const {
    if (rest.dof < 1 || joint_p(removed, rest) > rule.p) return false;
    // all members are tested with one scatter: the least of them decides
    double least = std::numeric_limits<double>::infinity(), least_studentised = least;
    for (const Eigen::Index row : removed) {
      const double size = std::abs(y_[row] - X_.row(row) * rest.coefficients);
      least = std::min(least, size);
      least_studentised = std::min(least_studentised, size / std::sqrt(1 + leverage(rest, row)));
    }
    least_studentised /= std::sqrt(std::max(rest.variance(), least_variance_));
    if (row_p(least_studentised, rest.dof) > rule.p) return false;
    const Eigen::VectorXd fitted = X_ * rest.coefficients;
    return least >= rule.share_of_span * (fitted.maxCoeff() - fitted.minCoeff());
  }

 private:
  double leverage(const RestFit& rest, Eigen::Index row) const {
    return X_.row(row) * rest.inverse_normal * X_.row(row).transpose();
  }

  /// P of the joint mean-shift F test, times the number of sets of that size.
  double joint_p(const RemovedRows& removed, const RestFit& rest) const {
    const auto k = static_cast<double>(removed.size());
    const double excess = (all_sum_ - rest.residual_sum) / k;
    const double f = excess / std::max(rest.variance(), least_variance_);
    return f_upper_p(std::max(f, 0.0), k, rest.dof) *
           std::exp(log_binomial(static_cast<double>(X_.rows()), k));
  }

  double row_p(double studentised, int dof) const {
    return std::min(1.0, static_cast<double>(X_.rows()) * student_t_two_sided_p(studentised, dof));
  }

  const Eigen::MatrixXd& X_;
  const Eigen::VectorXd& y_;
  double all_sum_;
  double least_variance_;
};

/// The largest gross set. Of each size up to `largest` there are two candidates, the farthest from a robust
/// fit and those of stepwise deletion: whichever leaves less scatter is tested.
Rows gross_rows(const Eigen::MatrixXd& X, const Eigen::VectorXd& y, const GrossRule& rule,
                const Tester& tester, Eigen::Index largest) {
  Rows farthest_first = nearest(X, y, least_trimmed_squares(X, y), X.rows());
  std::reverse(farthest_first.begin(), farthest_first.end());
  const Removal trimmed = remove_in_order(X, y, farthest_first, largest);
  const Removal stepwise = remove_stepwise(X, y, largest);
  for (auto size = static_cast<std::size_t>(largest); size > 0; --size) {
    const RestFit *of_trimmed = trimmed.without(size), *of_stepwise = stepwise.without(size);
    const bool step = of_stepwise && (!of_trimmed || of_stepwise->residual_sum < of_trimmed->residual_sum);
    const RestFit* rest = step ? of_stepwise : of_trimmed;
    if (!rest) continue;
    const RemovedRows removed((step ? stepwise : trimmed).order.data(), size);
    if (tester.keeps(rule, removed, *rest)) return {removed.begin(), removed.end()};
  }
  return {};
}

}  // namespace

Eigen::VectorXd least_trimmed_squares(const Eigen::MatrixXd& X, const Eigen::VectorXd& y) {
  const Eigen::VectorXd scale = X.colwise().norm();
  const Eigen::MatrixXd scaled = X * scale.cwiseInverse().asDiagonal();
  const Eigen::Index half = (X.rows() + X.cols() + 1) / 2;
  Eigen::VectorXd best = scaled.colPivHouseholderQr().solve(y);
  double least = std::numeric_limits<double>::infinity();
  for (const Rows& order : starting_orders(X.rows(), X.cols())) {
    auto found = solve_rows(scaled, y, independent_rows(scaled, order));
    for (int step = 0; found && step < 2; ++step)
      found = solve_rows(scaled, y, nearest(scaled, y, *found, half));
    if (!found) continue;
    const Rows kept = nearest(scaled, y, *found, half);
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
  const Tester tester(X, y, *all);
  const Eigen::Index largest =
      std::min((X.rows() - X.cols() - 1) / 2, std::max<Eigen::Index>(1, X.rows() / 4));
  const Rows gross = gross_rows(X, y, rule, tester, largest);
  Mask keep = Mask::Constant(X.rows(), true);
  for (const Eigen::Index row : gross) keep[row] = false;
  const auto rest = regress(rows_where(X, keep), rows_where(y, keep));
  return rest ? tester.rows(gross, RestFit(*rest)) : tester.rows({}, RestFit(*all));
}

}  // namespace tunnelrig
