// Covariance matrix adaptation evolution strategy (Hansen 2016, "The CMA Evolution Strategy: A Tutorial", arXiv:1604.00772).
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

namespace tunnelrig {

struct CmaSettings {
  int evaluations = 300;  // the budget; the start counts
  double step = 0.3;      // initial standard deviation in every coordinate
  std::uint64_t seed = 1;
};

struct CmaResult {
  std::vector<double> best;
  double cost = 0, cost_at_start = 0;
  int evaluations = 0;
};

/// Minimises `cost`, which must be finite, from `start`, its first evaluation, within [low, high] of each coordinate (values
/// beyond are moved to the border before they are judged).
CmaResult minimise(const std::function<double(const std::vector<double>&)>& cost, const std::vector<double>& start,
                   const std::vector<double>& low, const std::vector<double>& high, const CmaSettings& settings);

}  // namespace tunnelrig
