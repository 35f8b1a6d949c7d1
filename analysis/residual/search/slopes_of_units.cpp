#include "analysis/residual/search/slopes_of_units.h"

#include "calibration/distributions.h"

#include <algorithm>
#include <cmath>

namespace tunnelrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Rows of each group, or of each block.
using Units = std::vector<std::vector<Index>>;

VectorXd within(const Units& units, const VectorXd& values) {
  VectorXd result = values;
  for (const auto& own : units) result(own).array() -= VectorXd(values(own)).mean();
  return result;
}

/// Of a condition's variance, what is within units.
double share_within(const Units& units, const VectorXd& values) {
  const VectorXd centred = values.array() - values.mean();
  return within(units, values).squaredNorm() / std::max(centred.squaredNorm(), 1e-300);
}

/// A slope of each unit, how well it is known, and the steady condition there.
struct Slopes {
  VectorXd slope, variance, steady;
};

Slopes slopes_of(const Units& units, const VectorXd& steady, const VectorXd& varying, const VectorXd& left) {
  constexpr double kLeast = 1e-6;  // of what the condition varies in a unit, on the average
  const VectorXd x = within(units, varying), y = within(units, left);
  std::vector<double> squares, slopes, of_steady;
  double rest = 0, dof = 0;
  for (const auto& own : units) {
    const VectorXd own_x = x(own), own_y = y(own);
    const double square = own_x.squaredNorm();
    if (!(square > kLeast * x.squaredNorm() / static_cast<double>(units.size()))) continue;
    squares.push_back(square);
    slopes.push_back(own_x.dot(own_y) / square);
    of_steady.push_back(VectorXd(steady(own)).mean());
    rest += (own_y - slopes.back() * own_x).squaredNorm();
    dof += static_cast<double>(own.size()) - 2;
  }
  const auto as_vector = [](const std::vector<double>& v) {
    return VectorXd(Eigen::Map<const VectorXd>(v.data(), std::ssize(v)));
  };
  const double variance = dof > 0 ? rest / dof : 0;
  return {as_vector(slopes), variance * as_vector(squares).cwiseInverse(), as_vector(of_steady)};
}

/// Of the regression of slopes on the steady condition, units with a variance τ² of their own (DerSimonian &
/// Laird 1986; with the t distribution, Knapp & Hartung 2003).
double p_of_regression(const Slopes& of) {
  constexpr Index kFewest = 4;
  const Index n = of.slope.size();
  if (n < kFewest) return 1;
  MatrixXd design(n, 2);
  design << VectorXd::Ones(n), of.steady.array() - of.steady.mean();
  if (!(design.col(1).squaredNorm() > 0)) return 1;
  const auto covariance_with = [&](const VectorXd& weight) -> MatrixXd {
    return (design.transpose() * weight.asDiagonal() * design).inverse();
  };
  const auto left_with = [&](const VectorXd& weight, const MatrixXd& covariance) -> VectorXd {
    return of.slope - design * (covariance * (design.transpose() * weight.cwiseProduct(of.slope)));
  };
  const double least = 1e-12 * of.slope.squaredNorm() / static_cast<double>(n) + 1e-300;
  const VectorXd known = of.variance.cwiseMax(least).cwiseInverse();
  const MatrixXd by_known = covariance_with(known);
  const VectorXd left = left_with(known, by_known);
  const double dof = static_cast<double>(n) - 2, q = known.dot(left.cwiseAbs2());
  const MatrixXd twice = design.transpose() * known.cwiseAbs2().asDiagonal() * design;
  const double own = std::max(0.0, (q - dof) / (known.sum() - (by_known * twice).trace()));
  const VectorXd weight = (of.variance.array().max(least) + own).inverse();
  const MatrixXd covariance = covariance_with(weight);
  const double spread = std::max(1.0, weight.dot(left_with(weight, covariance).cwiseAbs2()) / dof);
  const double slope = covariance.row(1).dot(design.transpose() * weight.cwiseProduct(of.slope));
  const double p = student_t_two_sided_p(slope / std::sqrt(spread * covariance(1, 1)), dof);
  return std::isfinite(p) ? p : 1;
}

/// Of what the condition does to the slope within units, each with a slope of its own.
double p_within(const Units& units, const VectorXd& steady, const VectorXd& varying, const VectorXd& left) {
  const VectorXd of_steady = within(units, steady), x = within(units, varying), y = within(units, left);
  double both = 0, square = 0, rest = 0, dof = -1;
  for (const auto& own : units) {
    const VectorXd own_x = x(own), own_y = y(own);
    if (own.size() < 3 || !(own_x.squaredNorm() > 0)) continue;
    const auto beside_slope = [&](VectorXd values) -> VectorXd {
      values.array() -= values.mean();
      return values - own_x * (own_x.dot(values) / own_x.squaredNorm());
    };
    const VectorXd product = beside_slope(own_x.cwiseProduct(VectorXd(of_steady(own))));
    const VectorXd beside = beside_slope(own_y);
    both += product.dot(beside);
    square += product.squaredNorm();
    rest += beside.squaredNorm();
    dof += static_cast<double>(own.size()) - 2;
  }
  if (!(square > 0) || dof < 1) return 1;
  rest = std::max(rest - both * both / square, 1e-300);
  return student_t_two_sided_p(both / std::sqrt(square * rest / dof), dof);
}

/// Of a product with a condition that is mostly the unit's own: told by the units' slopes, or by what it does
/// within units where it varies there.
double p_of_slopes(const Units& units, const VectorXd& steady, const VectorXd& varying,
                   const VectorXd& left) {
  constexpr double kNone = 1e-6;
  const double between = p_of_regression(slopes_of(units, steady, varying, left));
  if (share_within(units, steady) < kNone) return between;
  return std::min(1.0, 2 * std::min(between, p_within(units, steady, varying, left)));
}

/// The largest p among those of groups and of blocks of which one of its conditions mostly is, and the other
/// is not; −1: none is.
double p_of_units(const SearchData& data, const VectorXd& left, const Curve& product) {
  constexpr double kSteady = 0.35;  // two runs of a unit have half of the variance within it by chance
  const Observations& o = data.observations();
  const VectorXd first = product.x(data.rows(), 0), second = o.find(product.times())->value(data.rows(), 0);
  double p = -1;
  for (const std::vector<int>* belongs : {&o.group, &o.block}) {
    const Units units = without_numbers(places_of_each(*belongs, data.rows()));
    const bool steady_first = share_within(units, first) < kSteady,
               steady_second = share_within(units, second) < kSteady;
    if (steady_first == steady_second) continue;
    p = std::max(
        p, steady_first ? p_of_slopes(units, first, second, left) : p_of_slopes(units, second, first, left));
  }
  return p;
}

/// What the fit leaves of the runs, of all rotors together, beside the baseline.
VectorXd left_by(const SearchData& data, const JointFit& fit) {
  const Components of_rotors = left_beside(data.observations(), difference(data.y(), fit.linear.offset),
                                           fit.linear.columns, fit.variances, data.rows());
  Stacked left = data.baseline().stack(0, {&of_rotors});
  data.baseline().project(0, 0, left);
  return left.col(0).head(std::ssize(data.rows()));
}

}  // namespace

std::vector<Curve> with_slopes_that_follow(const SearchData& data, const JointFit& fit,
                                           std::vector<Curve> tried) {
  if (std::ranges::none_of(tried, [](const Curve& curve) { return curve.strength.has_value(); }))
    return tried;
  const VectorXd left = left_by(data, fit);
  std::vector<double> p;
  for (const Curve& curve : tried) p.push_back(curve.strength ? p_of_units(data, left, curve) : -1);
  const auto asked = std::ranges::count_if(p, [](double each) { return each >= 0; });
  std::vector<Curve> kept;
  for (std::size_t i = 0; i < tried.size(); ++i)
    if (p[i] * static_cast<double>(asked) <= data.settings().alpha) kept.push_back(std::move(tried[i]));
  return kept;
}

}  // namespace tunnelrig
