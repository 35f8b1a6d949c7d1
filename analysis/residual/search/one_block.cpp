#include "analysis/residual/search/one_block.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace tunnelrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Columns and y of one stratum, the model so far taken out, as the fit's variances weigh them.
struct Left {
  MatrixXd columns;
  VectorXd y;
};

Left beside_model(const SearchData& data, const JointFit& base, const std::vector<Components>& own_columns,
                  const Components& y, std::size_t stratum) {
  const MixedModel& mixed = data.mixed();
  std::vector<const Components*> items = pointers_to(base.linear.columns);
  const auto adopted = static_cast<Index>(items.size()), own = static_cast<Index>(own_columns.size());
  for (const Components& column : own_columns) items.push_back(&column);
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

}  // namespace

int block_missed_most(const SearchData& data, const JointFit& base, const std::vector<Components>& columns) {
  const auto& blocks = data.mixed().blocks();
  const auto k = static_cast<Index>(columns.size());
  const Components y = difference(data.y(), base.linear.offset);
  std::vector<MatrixXd> squares(blocks.size(), MatrixXd::Zero(k, k));
  std::vector<VectorXd> products(blocks.size(), VectorXd::Zero(k));
  for (std::size_t s = 0; s < data.mixed().strata().size(); ++s) {
    const Left left = beside_model(data, base, columns, y, s);
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
  const int row = data.rows()[static_cast<std::size_t>(blocks[most].front())];
  return data.observations().block[static_cast<std::size_t>(row)];
}

std::vector<CandidateFit> fits_without(const SearchData& data, const JointFit& base, int block,
                                       const std::vector<Candidate>& candidates) {
  std::vector<int> others = data.rows();
  std::erase_if(others,
                [&](int row) { return data.observations().block[static_cast<std::size_t>(row)] == block; });
  const MixedModel rest(data.observations(), std::move(others));
  return CandidateScan(rest, base.linear.columns, candidates).fit(difference(data.y(), base.linear.offset));
}

}  // namespace tunnelrig
