#include "analysis/residual/scatter/run_scatter.h"

#include "analysis/residual/scatter/alike.h"
#include "analysis/upper_median.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace tunnelrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kUnlike = 2;  // less makes no structure
constexpr double kLeastLeftOfMean = 1e-3;

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
  std::map<int, std::vector<Index>> by_number = places_of_each(number, rows);
  // Nothing is left of the only run at a location, nor of a session of such.
  std::erase_if(by_number,
                [&](const auto& set) { return alike(set.second, Eigen::all).mean() < kLeastLeftOfMean; });
  if (by_number.size() < kFewestToCompare) return;
  const VectorXd times = scatter_of(compare(size, alike, without_numbers(by_number)));
  for (Index row = 0; row < scatter.size(); ++row) {
    const auto set = by_number.find(number[static_cast<std::size_t>(row)]);
    if (set != by_number.end()) scatter(row) *= times(std::distance(by_number.begin(), set));
  }
}

}  // namespace

RunSizes run_sizes(const MixedModel& model, const NullFit& variances, const Components& y,
                   const std::vector<Components>& columns, std::mt19937_64& random) {
  const std::vector<const Components*> items = pointers_to(columns);
  const auto k = static_cast<Index>(items.size()), n = static_cast<Index>(model.rows().size());
  std::vector<Stacked> data, fitted;  // of each stratum: the measured and the drawn, and the columns
  MatrixXd information = MatrixXd::Zero(k, k), products = MatrixXd::Zero(k, 1 + kAlikeSets);
  for (std::size_t s = 0; s < model.strata().size(); ++s) {
    const std::size_t ratio = variances.ratio[s];
    const Stacked own = model.stack(s, {&y}) / variances.sigma[s];
    data.emplace_back(own.rows(), 1 + kAlikeSets);
    data[s] << own, model.simulate_unit(s, ratio, kAlikeSets, 0, random);
    model.project(s, ratio, data[s]);
    fitted.emplace_back(model.stack(s, items) / variances.sigma[s]);
    if (k == 0) continue;
    model.project(s, ratio, fitted[s]);
    information += fitted[s].transpose() * fitted[s];
    products += fitted[s].transpose() * data[s];
  }
  const MatrixXd amplitude =
      k > 0 ? MatrixXd(information.completeOrthogonalDecomposition().solve(products)) : products;
  MatrixXd size = MatrixXd::Zero(n, 1 + kAlikeSets);
  for (std::size_t s = 0; s < model.strata().size(); ++s) {
    if (!model.strata()[s].means()) continue;
    const MatrixXd left = (data[s] - fitted[s] * amplitude).cwiseAbs();
    for (Index mode = 0; mode < model.strata()[s].modes; ++mode) size += left.middleRows(mode * n, n);
  }
  const VectorXd common = data[0].col(0).head(n) - fitted[0].topRows(n) * amplitude.col(0);
  return {model.rows(), size.col(0), common, size.rightCols(kAlikeSets)};
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
