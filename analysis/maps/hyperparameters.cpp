#include "analysis/maps/hyperparameters.h"

#include "analysis/maps/rig_offset.h"
#include "analysis/maps/symmetric_kernel.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <Eigen/Cholesky>
#include <ceres/gradient_problem.h>
#include <ceres/gradient_problem_solver.h>

namespace tunnelrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Logarithms of amplitude, length_y, length_z and excess.
using Parameters = Eigen::Vector4d;

Hyperparameters hyperparameters_of(const Parameters& p) {
  return {.amplitude_percent = std::exp(p(0)),
          .length_y = std::exp(p(1)),
          .length_z = std::exp(p(2)),
          .excess_percent = std::exp(p(3))};
}

struct LogPrior {
  Parameters mean, std;
};

LogPrior log_prior(const FieldData& data, const HyperparameterPriors& priors) {
  const auto n = static_cast<double>(data.size());
  const VectorXd field =
      data.values - offset_weights_on_centre_line(data).weights.dot(data.values) * column_of_offset(data);
  const double rms = std::max(std::sqrt(field.squaredNorm() / n), 1e-3);
  // The mean square scatter that the measured covariance makes between locations: what they share drops out.
  const double scatter = (data.covariance.trace() - data.covariance.sum() / n) / (n - 1);
  const double noise = std::max(std::sqrt(std::max(0.0, scatter)), 0.01 * rms);
  return {{std::log(rms), std::log(priors.length), std::log(priors.length), std::log(noise)},
          {priors.amplitude_log_std, priors.length_log_std, priors.length_log_std, priors.excess_log_std}};
}

/// Value and gradient of −log p(values | parameters), Rasmussen & Williams (2006), (5.8), (5.9); with a free
/// offset (2.45), whose gradient has P in place of the inverse.
struct NegativeLogLikelihood {
  double value = std::numeric_limits<double>::infinity();
  Parameters gradient = Parameters::Zero();
};

NegativeLogLikelihood negative_log_likelihood(const FieldData& data, const Parameters& p) {
  const Hyperparameters h = hyperparameters_of(p);
  const auto base = [&h](double dy, double dz) { return matern(h, dy, dz); };
  const Index n = data.size();
  std::array<MatrixXd, 3> kernel;  // K, ∂K/∂ln ℓ_y, ∂K/∂ln ℓ_z
  kernel.fill(MatrixXd(n, n));
  for (Index i = 0; i < n; ++i) {
    for (Index j = 0; j <= i; ++j) {
      const Eigen::Array3d k = anchored(base, data.parity, data.points[static_cast<std::size_t>(i)],
                                        data.points[static_cast<std::size_t>(j)]);
      for (Index term = 0; term < 3; ++term) {
        kernel[static_cast<std::size_t>(term)](i, j) = kernel[static_cast<std::size_t>(term)](j, i) = k(term);
      }
    }
  }
  const MatrixXd covariance = kernel[0] + noise_covariance(data, h);
  const Eigen::LLT<MatrixXd> factor(covariance);
  if (factor.info() != Eigen::Success) return {};
  const VectorXd column = column_of_offset(data);
  const OffsetWeights offset = offset_weights(factor, column);
  const MatrixXd inverse = without_offset(factor.solve(MatrixXd::Identity(n, n)), offset);
  const VectorXd weights = factor.solve(data.values - offset.weights.dot(data.values) * column);
  const VectorXd diagonal = factor.matrixLLT().diagonal();
  const double of_offset = offset.variance > 0 ? -0.5 * std::log(offset.variance) : 0;
  const MatrixXd slope = 0.5 * (inverse - weights * weights.transpose());
  const double by_excess = 2 * h.excess_percent * h.excess_percent * slope.cwiseProduct(data.excess).sum();
  return {0.5 * data.values.dot(weights) + diagonal.array().log().sum() + of_offset,
          {2 * slope.cwiseProduct(kernel[0]).sum(), slope.cwiseProduct(kernel[1]).sum(),
           slope.cwiseProduct(kernel[2]).sum(), by_excess}};
}

/// What is minimised: likelihood and prior.
class NegativeLogPosterior final : public ceres::FirstOrderFunction {
 public:
  NegativeLogPosterior(const FieldData& data, const LogPrior& prior) : data_(data), prior_(prior) {}

  int NumParameters() const override { return static_cast<int>(Parameters::SizeAtCompileTime); }

  bool Evaluate(const double* parameters, double* cost, double* gradient) const override {
    const Parameters p = Eigen::Map<const Parameters>(parameters);
    const NegativeLogLikelihood likelihood = negative_log_likelihood(data_, p);
    const Parameters deviation = (p - prior_.mean).cwiseQuotient(prior_.std);
    *cost = likelihood.value + 0.5 * deviation.squaredNorm();
    if (gradient != nullptr) {
      Eigen::Map<Parameters>{gradient} = likelihood.gradient + deviation.cwiseQuotient(prior_.std);
    }
    return std::isfinite(*cost);
  }

 private:
  const FieldData& data_;
  const LogPrior& prior_;
};

}  // namespace

Hyperparameters fit_hyperparameters(const FieldData& data, const HyperparameterPriors& priors) {
  const LogPrior prior = log_prior(data, priors);
  const ceres::GradientProblem problem(new NegativeLogPosterior(data, prior));
  ceres::GradientProblemSolver::Options options;
  options.line_search_direction_type = ceres::BFGS;
  options.max_num_iterations = 200;
  options.function_tolerance = 1e-10;
  options.logging_type = ceres::SILENT;

  Parameters best = prior.mean;
  double lowest = std::numeric_limits<double>::infinity();
  for (const double start_y : {-1.0, 0.5}) {  // short and long correlation in each direction
    for (const double start_z : {-1.0, 0.5}) {
      Parameters p = prior.mean + Parameters(0, start_y, start_z, 0);
      ceres::GradientProblemSolver::Summary summary;
      ceres::Solve(options, problem, p.data(), &summary);
      if (!summary.IsSolutionUsable() || summary.final_cost >= lowest) continue;
      lowest = summary.final_cost;
      best = p;
    }
  }
  return hyperparameters_of(best);
}

}  // namespace tunnelrig
