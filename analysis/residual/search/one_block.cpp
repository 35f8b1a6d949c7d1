#include "analysis/residual/search/one_block.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace tunnelrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// One stratum's runs by one column each, the model so far taken out: what a curve's columns and y have in
/// common, as far as the fit's variances weigh it.
struct Left {
  MatrixXd columns;
  VectorXd y;
};

Left beside_model(const SearchData& data, const JointFit& base, const Curve& curve, std::size_t stratum) {
  const MixedModel& mixed = data.mixed();
  const Components y = difference(data.y(), base.linear.offset);
  std::vector<const Components*> items = pointers_to(base.linear.columns);
  const auto adopted = static_cast<Index>(items.size()), own = static_cast<Index>(curve.columns.size());
  for (const Components& column : curve.columns) items.push_back(&column);
  items.push_back(&y);
  Stacked stacked = mixed.stack(stratum, items);
  mixed.project(stratum, base.variances.ratio[stratum], stacked);
  stacked /= std::max(base.variances.sigma[stratum], 1e-150);
  if (adopted > 0) {
    const MatrixXd of_model = stacked.leftCols(adopted);
    const Eigen::CompleteOrthogonalDecomposition<MatrixXd> solver(of_model);
    stacked.rightCols(own + 1) -= of_model * solver.solve(stacked.rightCols(own + 1));
  }
  return {stacked.middleCols(adopted, own), stacked.col(adopted + own)};
}

/// Place of the block that the curve's evidence falls most without, as far as products tell: with the
/// variances, and what was taken out, as they are with it.
std::size_t missed_most(const SearchData& data, const JointFit& base, const Curve& curve) {
  const auto& blocks = data.mixed().blocks();
  const auto k = static_cast<Index>(curve.columns.size());
  std::vector<MatrixXd> squares(blocks.size(), MatrixXd::Zero(k, k));
  std::vector<VectorXd> products(blocks.size(), VectorXd::Zero(k));
  for (std::size_t s = 0; s < data.mixed().strata().size(); ++s) {
    const Left left = beside_model(data, base, curve, s);
    const auto runs = static_cast<Index>(data.rows().size());
    for (std::size_t b = 0; b < blocks.size(); ++b)
      for (const Index run : blocks[b])
        for (Index row = run; row < left.y.size(); row += runs) {  // of each mode
          squares[b] += left.columns.row(row).transpose() * left.columns.row(row);
          products[b] += left.columns.row(row).transpose() * left.y(row);
        }
  }
  MatrixXd all = MatrixXd::Zero(k, k);
  VectorXd with_y = VectorXd::Zero(k);
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    all += squares[b];
    with_y += products[b];
  }
  std::size_t most = 0;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    const VectorXd rest = with_y - products[b];
    const Eigen::CompleteOrthogonalDecomposition<MatrixXd> solver(all - squares[b]);
    const double evidence = rest.dot(solver.solve(rest));
    if (evidence < least) {
      least = evidence;
      most = b;
    }
  }
  return most;
}

}  // namespace

std::optional<int> block_that_alone_shows(const SearchData& data, const JointFit& base, const Curve& curve) {
  constexpr double kChance = 0.05;
  const Observations& observations = data.observations();
  if (observations.blocks_are_rows) return std::nullopt;
  const auto& of_it = data.mixed().blocks()[missed_most(data, base, curve)];
  const auto block_of = [&](int row) { return observations.block[static_cast<std::size_t>(row)]; };
  const int block = block_of(data.rows()[static_cast<std::size_t>(of_it.front())]);
  std::vector<int> others = data.rows();
  std::erase_if(others, [&](int row) { return block_of(row) == block; });
  const MixedModel rest(observations, others);
  const auto seen = [&](const std::vector<Components>& columns) {
    std::vector<Components> result = columns;
    std::erase_if(result, [&](const Components& column) { return !rest.sees(column); });
    return result;
  };
  const Candidate candidate{.columns = seen(curve.columns)};
  if (candidate.columns.empty()) return block;
  const CandidateScan scan(rest, seen(base.linear.columns), {candidate});
  const double evidence = scan.fit(difference(data.y(), base.linear.offset)).front().evidence;
  if (evidence < -std::log10(kChance)) return block;
  return std::nullopt;
}

}  // namespace tunnelrig
