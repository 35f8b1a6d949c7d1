#include "flight/tuning/cma_es.h"

#include "flight/vehicle/random.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include <Eigen/Eigenvalues>

namespace tunnelrig {

SearchResult minimise(const std::function<double(const Eigen::VectorXd&)>& cost, const Eigen::VectorXd& start,
                      double spread, int budget, std::uint64_t seed) {
  const Eigen::Index n = start.size();
  const auto dim = static_cast<double>(n);
  const int population = 4 + static_cast<int>(3 * std::log(dim)), parents = population / 2;
  Eigen::VectorXd weight(parents);
  for (int i = 0; i < parents; ++i) weight[i] = std::log(0.5 * (population + 1)) - std::log(i + 1.0);
  weight /= weight.sum();
  const double mu = 1 / weight.squaredNorm();
  const double c_sigma = (mu + 2) / (dim + mu + 5), c_path = (4 + mu / dim) / (dim + 4 + 2 * mu / dim);
  const double damping = 1 + 2 * std::max(0.0, std::sqrt((mu - 1) / (dim + 1)) - 1) + c_sigma;
  const double c_one = 2 / ((dim + 1.3) * (dim + 1.3) + mu);
  const double c_mu = std::min(1 - c_one, 2 * (mu - 2 + 1 / mu) / ((dim + 2) * (dim + 2) + mu));
  const double expected = std::sqrt(dim) * (1 - 1 / (4 * dim) + 1 / (21 * dim * dim));

  Random random(seed);
  Eigen::VectorXd mean = start, path = Eigen::VectorXd::Zero(n), path_sigma = path;
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Identity(n, n);
  double sigma = spread;
  SearchResult result{start, cost(start), 1};
  while (result.evaluations < budget) {
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(covariance);
    const Eigen::VectorXd scale = eigen.eigenvalues().cwiseMax(1e-12).cwiseSqrt();
    std::vector<Eigen::VectorXd> step;
    std::vector<double> value;
    for (int k = 0; k < population && result.evaluations < budget; ++k, ++result.evaluations) {
      Eigen::VectorXd z(n);
      for (Eigen::Index i = 0; i < n; ++i) z[i] = random.normal();
      step.emplace_back(eigen.eigenvectors() * scale.cwiseProduct(z));
      const Eigen::VectorXd wanted = mean + sigma * step.back(), inside = wanted.cwiseMax(0).cwiseMin(1);
      const double inside_cost = cost(inside);
      if (inside_cost < result.cost) result.best = inside, result.cost = inside_cost;
      value.push_back(inside_cost * (1 + 10 * (wanted - inside).squaredNorm()));
    }
    if (static_cast<int>(step.size()) < population) break;
    std::vector<std::size_t> order(step.size());
    std::iota(order.begin(), order.end(), 0U);
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return value[a] < value[b]; });

    Eigen::VectorXd move = Eigen::VectorXd::Zero(n);
    Eigen::MatrixXd rank_mu = Eigen::MatrixXd::Zero(n, n);
    for (int i = 0; i < parents; ++i) {
      const Eigen::VectorXd& y = step[order[static_cast<std::size_t>(i)]];
      move += weight[i] * y;
      rank_mu += weight[i] * y * y.transpose();
    }
    mean = (mean + sigma * move).cwiseMax(0).cwiseMin(1);
    const Eigen::VectorXd whitened =
        eigen.eigenvectors() * (eigen.eigenvectors().transpose() * move).cwiseQuotient(scale);
    path_sigma = (1 - c_sigma) * path_sigma + std::sqrt(c_sigma * (2 - c_sigma) * mu) * whitened;
    path = (1 - c_path) * path + std::sqrt(c_path * (2 - c_path) * mu) * move;
    covariance = (1 - c_one - c_mu) * covariance + c_one * path * path.transpose() + c_mu * rank_mu;
    sigma *= std::exp(c_sigma / damping * (path_sigma.norm() / expected - 1));
    sigma = std::min(sigma, 0.5);
  }
  return result;
}

}  // namespace tunnelrig
