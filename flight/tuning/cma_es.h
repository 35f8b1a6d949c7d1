// Covariance matrix adaptation (Hansen and Ostermeier 2001; constants of Hansen's tutorial, 2016), for a
// handful of parameters.
#pragma once

#include <cstdint>
#include <functional>

#include <Eigen/Core>

namespace tunnelrig {

struct SearchResult {
  Eigen::VectorXd best;
  double cost = 0;
  int evaluations = 0;
};

/// Least cost over the unit cube, from `start`, with steps of `spread` at first; points outside are evaluated
/// at the nearest point of the cube and pay for the distance. Stops after `budget` evaluations, never fewer.
SearchResult minimise(const std::function<double(const Eigen::VectorXd&)>& cost, const Eigen::VectorXd& start,
                      double spread, int budget, std::uint64_t seed);

}  // namespace tunnelrig
