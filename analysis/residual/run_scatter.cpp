#include "analysis/residual/run_scatter.h"

#include "analysis/residual/upper_median.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace tunnelrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kAlikeSets = 200;
constexpr double kUnlike = 2;  // less makes no structure
constexpr double kLeastLeft = 1e-3;
constexpr std::size_t kFewest = 3;  // of two, nothing says which of them scatters

/// Mean size of what is left of each run, over its standard deviation, of the means' strata; a column for
/// each data set.
class Sizes {
 public:
  Sizes(const MixedModel& model, const NullFit& variances) : model_(model), variances_(variances) {}

  MatrixXd of(const Components& residual) const {
    return sum(1, [&](std::size_t s) { return model_.stack(s, {&residual}); });
  }
  MatrixXd simulated(std::mt19937_64& random) const {
    return sum(kAlikeSets, [&](std::size_t s) {
      return model_.simulate(s, std::vector<double>(kAlikeSets, variances_.sigma[s]),
                             std::vector<std::size_t>(kAlikeSets, variances_.ratio[s]), 0, random);
    });
  }

 private:
  template <class Data>
  MatrixXd sum(Index sets, const Data& data) const {
    const auto n = static_cast<Index>(model_.rows().size());
    MatrixXd result = MatrixXd::Zero(n, sets);
    for (std::size_t s = 0; s < model_.strata().size(); ++s) {
      if (!model_.strata()[s].means()) continue;
      Stacked stacked = data(s);
      model_.project(s, variances_.ratio[s], stacked);
      for (Index set = 0; set < sets; ++set)
        result.col(set) += Eigen::Map<const MatrixXd>(stacked.col(set).data(), n, model_.strata()[s].modes)
                               .cwiseAbs()
                               .rowwise()
                               .sum() /
                           variances_.sigma[s];
    }
    return result;
  }

  const MixedModel& model_;
  const NullFit& variances_;
};

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
  if (by_number.size() < kFewest) return;
  std::vector<std::vector<Index>> sets;
  for (const auto& [of, runs] : by_number) sets.push_back(runs);
  const VectorXd times = scatter_of(compare(size, alike, sets));
  for (Index row = 0; row < scatter.size(); ++row) {
    const auto set = by_number.find(number[static_cast<std::size_t>(row)]);
    if (set != by_number.end()) scatter(row) *= times(std::distance(by_number.begin(), set));
  }
}

}  // namespace

VectorXd run_scatter(const Observations& observations, const MixedModel& model, const NullFit& variances,
                     const Components& residual, std::mt19937_64& random) {
  if (observations.from_table) return {};
  const Sizes sizes(model, variances);
  const MatrixXd size = sizes.of(residual), alike = sizes.simulated(random);
  VectorXd result = VectorXd::Ones(observations.rows());
  let_differ(observations.group, model.rows(), size, alike, result);
  // A session is not wilder for its runs at a wild location.
  const MatrixXd beside = size.cwiseQuotient(MatrixXd(result(model.rows())));
  let_differ(observations.block, model.rows(), beside, alike, result);
  if ((result.array() == 1).all()) return {};
  return result;
}

}  // namespace tunnelrig
