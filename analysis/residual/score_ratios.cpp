#include "analysis/residual/score_ratios.h"

#include <algorithm>

namespace tunnelrig {

using Eigen::Index;

Eigen::VectorXd score_ratios(const MixedModel& model, const ScanProducts& products,
                             const ScanProducts::Data& data, Index set, const StrataFit::State& held,
                             const std::vector<Index>& own) {
  const Index q = products.adopted(), columns = data[0][0].columns.rows() - q;
  Eigen::MatrixXd adopted = Eigen::MatrixXd::Zero(q, q), beside = Eigen::MatrixXd::Zero(q, columns);
  Eigen::VectorXd with_data = Eigen::VectorXd::Zero(q + columns);
  std::vector<double> weight;
  for (std::size_t s = 0; s < held.ratio.size(); ++s) {
    weight.push_back(static_cast<double>(model.dof(s)) / std::max(held.rss[s], 1e-300));
    with_data += weight[s] * data[s][held.ratio[s]].columns.col(set);
    if (!products.adopted_touch(s)) continue;
    const ScanProducts::Products& p = products.products(s, held.ratio[s]);
    adopted += weight[s] * p.adopted_adopted;
    beside += weight[s] * p.adopted_candidate.rightCols(columns);
  }
  adopted.diagonal().array() *= 1 + 1e-12;
  adopted.diagonal().array() += 1e-300;
  Eigen::MatrixXd on_adopted(q, columns);
  if (q > 0) {
    const Eigen::LDLT<Eigen::MatrixXd> normal(adopted);
    on_adopted = normal.solve(beside);
    with_data.tail(columns) -= on_adopted.transpose() * with_data.head(q);
  }
  Eigen::VectorXd result(own.size());
  for (std::size_t i = 0; i < own.size(); ++i) {
    const Index k = own[i], first = products.first(i);
    SmallMatrix information =
        -beside.middleCols(first - q, k).transpose() * on_adopted.middleCols(first - q, k);
    for (std::size_t s = 0; s < weight.size(); ++s)
      if (products.touches(i, s)) information += weight[s] * products.products(s, held.ratio[s]).candidate[i];
    const auto score = with_data.segment(first, k);
    result(static_cast<Index>(i)) = 0.5 * (k == 1 ? score(0) * score(0) / std::max(information(0, 0), 1e-300)
                                                  : score.dot(information.ldlt().solve(score)));
  }
  return result;
}

}  // namespace tunnelrig
