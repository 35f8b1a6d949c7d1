#include "analysis/residual/search/unseen.h"

namespace tunnelrig {

CrossValidation unseen(const SearchData& data, const JointFit& fit, const NullFit& variances) {
  return unseen(data, data.observations(), fit, variances);
}

CrossValidation unseen(const SearchData& data, const Observations& observations, const JointFit& fit,
                       const NullFit& variances) {
  return cross_validate(observations, difference(data.y(), fit.linear.offset), fit.linear.columns, variances,
                        data.rows());
}

CrossValidation unseen_with(const SearchData& data, const JointFit& base,
                            const std::vector<Components>& columns, const NullFit& variances) {
  return cross_validate(data.observations(), difference(data.y(), base.linear.offset), columns, variances,
                        data.rows());
}

std::vector<Components> columns_with(const JointFit& base, const std::vector<Components>& more) {
  std::vector<Components> columns = base.linear.columns;
  columns.insert(columns.end(), more.begin(), more.end());
  return columns;
}

}  // namespace tunnelrig
