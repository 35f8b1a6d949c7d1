#include "calibration/distributions.h"

#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include <Eigen/Core>
#include <unsupported/Eigen/SpecialFunctions>

namespace tunnelrig {
namespace {

/// x > 0 with upper(x) = target, for an upper tail that falls with x. Regula falsi (Illinois) on log(tail)
/// against log(x), where tails are nearly straight.
template <typename Tail>
double invert_upper_tail(const Tail& upper, double target, double guess) {
  const double goal = std::log(target);
  const auto excess = [&](double log_x) { return std::log(upper(std::exp(log_x))) - goal; };
  double left = std::log(guess), right = left;
  double at_left = excess(left), at_right = at_left;
  for (double step = 0.5; at_left < 0; step *= 2) at_left = excess(left -= step);
  for (double step = 0.5; at_right > 0; step *= 2) at_right = excess(right += step);
  for (int i = 0; i < 200 && right - left > 1e-14 * (1 + std::abs(left)) && at_left != at_right; ++i) {
    // a tail that has underflowed has no logarithm: halve until it has
    double middle = std::isfinite(at_right) ? right - at_right * (right - left) / (at_right - at_left)
                                            : 0.5 * (left + right);
    if (!(middle > left && middle < right)) middle = 0.5 * (left + right);
    const double at_middle = excess(middle);
    if (std::abs(at_middle) < 1e-14) return std::exp(middle);
    if (at_middle > 0) {
      left = middle;
      at_left = at_middle;
      at_right /= 2;
    } else {
      right = middle;
      at_right = at_middle;
      at_left /= 2;
    }
  }
  return std::exp(0.5 * (left + right));
}

// Beyond this the incomplete beta function loses digits, and the limits have more.
constexpr double kManyDof = 1e6;

/// |t| with this two-sided p, by Newton's steps on ln p against ln t, which is nearly straight: a map asks
/// for tens of thousands. Nothing where they do not settle. `z`: of the normal distribution.
std::optional<double> t_by_newton(double tail, double dof, double z) {
  constexpr double kSettled = 1e-7;  // steps square their error
  constexpr int kMostNewtonSteps = 12;
  const double log_density_at_0 =
      std::lgamma((dof + 1) / 2) - std::lgamma(dof / 2) - std::log(dof * std::numbers::pi) / 2;
  double t = z + z * (z * z + 1) / (4 * dof);  // Cornish and Fisher's first term
  for (int step = 0; step < kMostNewtonSteps; ++step) {
    const double p = student_t_two_sided_p(t, dof);
    const double density = std::exp(log_density_at_0 - (dof + 1) / 2 * std::log1p(t * t / dof));
    const double change = p * std::log(p / tail) / (2 * t * density);
    if (!std::isfinite(change) || std::abs(change) > 100) return std::nullopt;
    t *= std::exp(change);
    if (std::abs(change) < kSettled) return t;
  }
  return std::nullopt;
}

}  // namespace

double normal_quantile(double p) {
  assert(p > 0 && p < 1);
  return Eigen::numext::ndtri(p);
}

double student_t_two_sided_p(double t, double dof) {
  assert(dof > 0);
  if (std::isinf(t)) return 0;
  if (dof > kManyDof) {  // Wallace 1959: the error is of order dof⁻²
    const double z = std::isinf(dof) ? std::abs(t) : std::sqrt((dof - 0.5) * std::log1p(t * t / dof));
    return std::erfc(z / std::sqrt(2.0));
  }
  // Abramowitz and Stegun 26.7.1 with 26.5.2
  return Eigen::numext::betainc(dof / 2, 0.5, dof / (dof + t * t));
}

double student_t_quantile(double p, double dof) {
  assert(p > 0 && p < 1 && dof > 0);
  if (std::isinf(dof)) return normal_quantile(p);
  if (p == 0.5) return 0;
  const double tail = p < 0.5 ? 2 * p : 2 * (1 - p);
  const double z = std::abs(normal_quantile(tail / 2));
  std::optional<double> t = t_by_newton(tail, dof, z);
  if (!t) t = invert_upper_tail([dof](double x) { return student_t_two_sided_p(x, dof); }, tail, z);
  return p < 0.5 ? -*t : *t;
}

double half_width_95(double standard_error, double dof) {
  return student_t_quantile(0.975, dof) * standard_error;
}

double f_upper_p(double f, double dof1, double dof2) {
  assert(f >= 0 && dof1 > 0 && dof2 > 0);
  if (std::isinf(f)) return 0;
  if (dof2 > kManyDof) return chi2_upper_p(f * dof1, dof1);
  return Eigen::numext::betainc(dof2 / 2, dof1 / 2, dof2 / (dof2 + dof1 * f));  // A&S 26.6.2
}

double chi2_upper_p(double x, double dof) {
  assert(x >= 0 && dof > 0);
  return Eigen::numext::igammac(dof / 2, x / 2);  // A&S 26.4.19
}

double chi2_quantile(double p, double dof) {
  assert(p > 0 && p < 1 && dof > 0);
  return invert_upper_tail([dof](double x) { return chi2_upper_p(x, dof); }, 1 - p, dof);
}

}  // namespace tunnelrig
