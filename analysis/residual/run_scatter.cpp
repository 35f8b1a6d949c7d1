#include "analysis/residual/run_scatter.h"

#include "analysis/residual/alike.h"
#include "analysis/residual/upper_median.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace tunnelrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kUnlike = 2;  // less makes no structure
constexpr double kLeastLeft = 1e-3;

/// The size of what is left of each run, over σ, summed over the modes; a column for each data set.
MatrixXd sizes_of(const MixedModel& model, std::size_t stratum, std::size_t ratio, Stacked data) {
  model.project(stratum, ratio, data);
  const auto n = static_cast<Index>(model.rows().size());
  MatrixXd result(n, data.cols());
  for (Index set = 0; set < data.cols(); ++set)
    result.col(set) = Eigen::Map<const MatrixXd>(data.col(set).data(), n, model.strata()[stratum].modes)
                          .cwiseAbs()
                          .rowwise()
                          .sum();
  return result;
}

/// Of each set of runs: ln of its mean size over what runs that are alike have there.
struct Compared {
  VectorXd ln;            // of the data
  MatrixXd simulated_ln;  // sets of runs × data sets
};

Compared compare(const MatrixXd& size, const MatrixXd& alike, const std::vector<std::vector<Index>>& sets) {
  const auto count = static_cast<Index>(sets.size());
  Compared result{VectorXd(count), MatrixXd(count, alike.cols())};
  for (Index i = 0; i < count; ++i) {
    const auto& runs = sets[static_cast<std::size_t>(i)];
    const Eigen::RowVectorXd means = alike(runs, Eigen::all).colwise().mean();
    const double expected = means.mean();
    result.ln(i) = std::log(std::max(1e-9, size(runs, 0).mean() / expected));
    result.simulated_ln.row(i) = (means.array() / expected).log();
  }
  return result;
}

double middle(const VectorXd& values) {
  return upper_median(std::vector<double>(values.data(), values.data() + values.size()));
}

/// The scatter of each set over that of most; 1 where it is not clearly more.
VectorXd scatter_of(const Compared& compared) {
  const VectorXd from_most = compared.ln.array() - middle(compared.ln);
  const VectorXd spread = (compared.simulated_ln.array().square().rowwise().mean()).sqrt();
  double most = 0;
  for (Index set = 0; set < compared.simulated_ln.cols(); ++set) {
    const VectorXd ln = compared.simulated_ln.col(set);
    most = std::max(most, ((ln.array() - middle(ln)) / spread.array()).maxCoeff());
  }
  VectorXd result = VectorXd::Ones(from_most.size());
  for (Index i = 0; i < result.size(); ++i)
    if (from_most(i) > std::max(most * spread(i), std::log(kUnlike))) result(i) = std::exp(from_most(i));
  return result;
}

/// Multiplies the scatter of all runs that belong together by what those of the model show.
void let_differ(const std::vector<int>& number, const std::vector<int>& rows, const MatrixXd& size,
                const MatrixXd& alike, VectorXd& scatter) {
  std::map<int, std::vector<Index>> by_number;
  for (std::size_t k = 0; k < rows.size(); ++k)
    by_number[number[static_cast<std::size_t>(rows[k])]].push_back(static_cast<Index>(k));
  // Nothing is left of the only run at a location, nor of a session of such.
  std::erase_if(by_number,
                [&](const auto& set) { return alike(set.second, Eigen::all).mean() < kLeastLeft; });
  if (by_number.size() < kFewestToCompare) return;
  std::vector<std::vector<Index>> sets;
  for (const auto& [of, runs] : by_number) sets.push_back(runs);
  const VectorXd times = scatter_of(compare(size, alike, sets));
  for (Index row = 0; row < scatter.size(); ++row) {
    const auto set = by_number.find(number[static_cast<std::size_t>(row)]);
    if (set != by_number.end()) scatter(row) *= times(std::distance(by_number.begin(), set));
  }
}

}  // namespace

RunSizes run_sizes(const MixedModel& model, const NullFit& variances, const Components& residual,
                   std::mt19937_64& random) {
  const auto n = static_cast<Index>(model.rows().size());
  RunSizes result{model.rows(), VectorXd::Zero(n), MatrixXd::Zero(n, kAlikeSets)};
  for (std::size_t s = 0; s < model.strata().size(); ++s) {
    if (!model.strata()[s].means()) continue;
    const std::size_t ratio = variances.ratio[s];
    result.left += sizes_of(model, s, ratio, model.stack(s, {&residual}) / variances.sigma[s]).col(0);
    result.alike += sizes_of(model, s, ratio, model.simulate_unit(s, ratio, kAlikeSets, 0, random));
  }
  return result;
}

VectorXd run_scatter(const Observations& observations, const RunSizes& sizes) {
  if (observations.from_table) return {};
  VectorXd result = VectorXd::Ones(observations.rows());
  let_differ(observations.group, sizes.rows, sizes.left, sizes.alike, result);
  // A session is not wilder for its runs at a wild location.
  const MatrixXd beside = sizes.left.cwiseQuotient(VectorXd(result(sizes.rows)));
  let_differ(observations.block, sizes.rows, beside, sizes.alike, result);
  if ((result.array() == 1).all()) return {};
  return result;
}

}  // namespace tunnelrig
