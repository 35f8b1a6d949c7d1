#include "calibration/distributions.h"
#include "calibration/load_cell.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tunnelrig {
namespace {

/// The distribution of what the estimated variances may really be: their estimate over q, where q · dof is
/// chi-square. Nodes are even in ln q, where the density is smooth and falls fast on both sides, so that the
/// trapezoidal rule converges exponentially.
struct VarianceDraws {
  Eigen::ArrayXd q, probability;

  explicit VarianceDraws(double dof) {
    // ln density = dof/2 (x − eˣ) + const; the bounds leave out less than e⁻²⁵ of it
    const double lowest = dof > 150 ? -std::sqrt(150 / dof) : -(1 + 50 / dof);
    const double highest = std::min(std::sqrt(100 / dof), 1 + std::log1p(100 / dof));
    const double step = 0.2 * std::min(1.0, std::sqrt(2 / dof));
    const auto nodes = static_cast<Eigen::Index>(std::ceil((highest - lowest) / step)) + 1;
    const Eigen::ArrayXd x = Eigen::ArrayXd::LinSpaced(nodes, lowest, highest);
    q = x.exp();
    probability = (dof / 2 * (x - q + 1)).exp();
    probability /= probability.sum();
  }
};

/// The half width w for which a normal error holds P(|error| ≤ w) = confidence, averaged over its variances.
double half_width(const Eigen::ArrayXd& variance, const Eigen::ArrayXd& probability, double confidence) {
  const Eigen::ArrayXd deviation = variance.sqrt().max(1e-300);
  double width = 0;
  // P is concave in w, so that Newton's steps approach from below
  for (int i = 0; i < 100; ++i) {
    double held = 0, slope = 0;
    for (Eigen::Index k = 0; k < deviation.size(); ++k) {
      const double u = width / (deviation[k] * std::numbers::sqrt2);
      held += probability[k] * std::erf(u);
      slope += probability[k] * std::exp(-u * u) / deviation[k];
    }
    const double step = (confidence - held) / (slope * std::sqrt(2 / std::numbers::pi));
    width += step;
    if (!(std::abs(step) > 1e-9 * width)) break;
  }
  return width;
}

}  // namespace

ForcePrediction predict_force(const CellFit& fit, double voltage_V, double standard_error_V,
                              ReadingScatter scatter) {
  const VarianceDraws draws(fit.dof);
  const double known = standard_error_V * standard_error_V;
  const double residual = fit.residual_std_V * fit.residual_std_V;
  const double gauge = std::pow(fit.gain_V_per_N * fit.gauge_force_N, 2);
  const bool scatters = scatter == ReadingScatter::kAsCalibration;

  const auto line_variance = [&](double force) {
    const Eigen::Vector2d at(1, force);
    return at.dot(fit.covariance * at);
  };
  const auto width_at = [&](double force) {
    Eigen::ArrayXd variance = known + line_variance(force) / draws.q;
    if (scatters) variance += (residual / draws.q - gauge).max(0);
    return half_width(variance, draws.probability, fit.confidence) / std::abs(fit.gain_V_per_N);
  };

  ForcePrediction prediction;
  prediction.force_N = (voltage_V - fit.zero_V) / fit.gain_V_per_N;
  const double reading = scatters ? fit.reading_std_V * fit.reading_std_V : 0;
  prediction.standard_uncertainty_N =
      std::sqrt(known + reading + line_variance(prediction.force_N)) / std::abs(fit.gain_V_per_N);
  prediction.extrapolated =
      prediction.force_N < fit.lowest_force_N || prediction.force_N > fit.highest_force_N;

  // Fieller's ends solve end = force ± width(end). The width grows with the end by less than the end does,
  // because fit_load_cell refuses a gain that cannot be told from zero.
  const auto end = [&](double side) {
    double at = prediction.force_N;
    for (int i = 0; i < 200; ++i) {
      const double next = prediction.force_N + side * width_at(at);
      const bool still = std::abs(next - at) <= 1e-9 * std::abs(next - prediction.force_N);
      at = next;
      if (still) break;
    }
    return at;
  };
  prediction.lower_N = end(-1);
  prediction.upper_N = end(+1);
  return prediction;
}

}  // namespace tunnelrig
