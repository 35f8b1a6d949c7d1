// Rows that do not belong to the rest, found so that several gross ones do not hide each other.
#pragma once

#include <vector>

#include <Eigen/Core>

namespace tunnelrig {

/// How one row stands to the fit of the others.
struct RowTest {
  double leverage = 0;     // among the rows that are kept, itself included; 0 to 1
  double studentised = 0;  // residual from the fit without it, over its standard deviation: Student's t
  double p = 1;  // of that, times the number of rows that it was picked from (Bonferroni), at most 1
  bool gross = false;
};

/// A gross row is both too far off to be chance and large enough to matter.
struct GrossRule {
  double p = 0.001;              // at most
  double share_of_span = 0.005;  // residual at least, of the span of the values fitted to the other rows
};

/// Tests all rows of y = X β + ε. Candidate sets of up to a quarter of the rows are the farthest from a
/// least-trimmed-squares fit (Rousseeuw 1984, with the C-steps of Rousseeuw and Van Driessen 2006), and those
/// of stepwise deletion. The largest set is called gross whose joint mean-shift F test (Cook and Weisberg
/// 1982, chapter 2), times the number of sets of its size, keeps the rule, as each of its members does alone.
/// Deterministic. Without two degrees of freedom nothing can be said: all p = 1.
std::vector<RowTest> test_rows(const Eigen::MatrixXd& X, const Eigen::VectorXd& y, const GrossRule& rule);

/// β of the least-trimmed-squares fit that holds the best (n + p + 1)/2 rows: the start of robust fits.
Eigen::VectorXd least_trimmed_squares(const Eigen::MatrixXd& X, const Eigen::VectorXd& y);

}  // namespace tunnelrig
