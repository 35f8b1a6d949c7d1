#include "flight/tuning/cma_es.h"

#include "flight/vehicle/random.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <Eigen/Eigenvalues>

namespace tunnelrig {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// The constants of the tutorial's table 1 without its negative weights.
struct Constants {
  int population, parents;
  VectorXd weights;
  double mu, c_sigma, d_sigma, c_c, c_1, c_mu, chi;

  explicit Constants(double n) {
    population = 4 + static_cast<int>(3 * std::log(n));
    parents = population / 2;
    weights.resize(parents);
    for (int i = 0; i < parents; ++i) weights[i] = std::log((population + 1) / 2.0) - std::log(i + 1.0);
    weights /= weights.sum();
    mu = 1 / weights.squaredNorm();
    c_sigma = (mu + 2) / (n + mu + 5);
    d_sigma = 1 + 2 * std::max(0.0, std::sqrt((mu - 1) / (n + 1)) - 1) + c_sigma;
    c_c = (4 + mu / n) / (n + 4 + 2 * mu / n);
    c_1 = 2 / ((n + 1.3) * (n + 1.3) + mu);
    c_mu = std::min(1 - c_1, 2 * (mu - 2 + 1 / mu) / ((n + 2) * (n + 2) + mu));
    chi = std::sqrt(n) * (1 - 1 / (4 * n) + 1 / (21 * n * n));
  }
};

}  // namespace

CmaResult minimise(const std::function<double(const std::vector<double>&)>& cost, const std::vector<double>& start,
                   const std::vector<double>& low, const std::vector<double>& high, const CmaSettings& settings) {
  const auto n = static_cast<Eigen::Index>(start.size());
  const Constants k(static_cast<double>(n));
  Random random(settings.seed);
  VectorXd mean = Eigen::Map<const VectorXd>(start.data(), n);
  MatrixXd covariance = MatrixXd::Identity(n, n);
  VectorXd path_sigma = VectorXd::Zero(n), path_c = VectorXd::Zero(n);
  double sigma = settings.step;
  CmaResult result{start, cost(start), 0, 1};
  result.cost_at_start = result.cost;
  for (int generation = 1; result.evaluations + k.population <= settings.evaluations; ++generation) {
    const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(covariance);
    const VectorXd scale = eigen.eigenvalues().cwiseMax(1e-20).cwiseSqrt();
    const MatrixXd& axes = eigen.eigenvectors();
    std::vector<VectorXd> steps;
    std::vector<double> costs;
    for (int i = 0; i < k.population; ++i) {
      VectorXd z(n);
      for (double& value : z) value = random.normal();
      std::vector<double> x(start.size());
      VectorXd moved = mean + sigma * (axes * scale.cwiseProduct(z));
      for (std::size_t j = 0; j < x.size(); ++j) {
        x[j] = std::clamp(moved[static_cast<Eigen::Index>(j)], low[j], high[j]);
        moved[static_cast<Eigen::Index>(j)] = x[j];
      }
      steps.emplace_back((moved - mean) / sigma);
      costs.push_back(cost(x));
      ++result.evaluations;
      if (costs.back() < result.cost) {
        result.cost = costs.back();
        result.best = x;
      }
    }
    std::vector<std::size_t> order(costs.size());
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return costs[a] < costs[b]; });
    VectorXd step = VectorXd::Zero(n);
    MatrixXd rank_mu = MatrixXd::Zero(n, n);
    for (int i = 0; i < k.parents; ++i) {
      const VectorXd& y = steps[order[static_cast<std::size_t>(i)]];
      step += k.weights[i] * y;
      rank_mu += k.weights[i] * y * y.transpose();
    }
    mean += sigma * step;
    const VectorXd whitened = axes * (axes.transpose() * step).cwiseQuotient(scale);
    path_sigma = (1 - k.c_sigma) * path_sigma + std::sqrt(k.c_sigma * (2 - k.c_sigma) * k.mu) * whitened;
    const double expected = std::sqrt(1 - std::pow(1 - k.c_sigma, 2 * generation)) * k.chi;
    const bool holds = path_sigma.norm() < (1.4 + 2 / (static_cast<double>(n) + 1)) * expected;
    path_c = (1 - k.c_c) * path_c + (holds ? std::sqrt(k.c_c * (2 - k.c_c) * k.mu) : 0) * step;
    covariance = (1 - k.c_1 - k.c_mu) * covariance + k.c_1 * path_c * path_c.transpose() + k.c_mu * rank_mu;
    sigma *= std::exp(k.c_sigma / k.d_sigma * (path_sigma.norm() / k.chi - 1));
  }
  return result;
}

}  // namespace tunnelrig
