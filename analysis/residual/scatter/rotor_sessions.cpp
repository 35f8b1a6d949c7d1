#include "analysis/residual/scatter/rotor_sessions.h"

#include "analysis/residual/likelihood/session_directions.h"
#include "analysis/residual/scatter/alike.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include <Eigen/Eigenvalues>

namespace tunnelrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::VectorXd;

/// How a stratum's directions split, if one of them has a session variance of its own.
struct Split {
  double gain = 0;  // of the log-likelihood over alike sessions
  std::size_t own = 0, others = 0;
  double variance = 0;  // of runs
};

/// A rotor whose sessions differ more.
struct Unlike {
  Index rotor = 0;
  VectorXd direction;  // of an offset of it, among the differences
  double share = 1;    // of such an offset, squared: what is among the directions still alike
  Split split;
};

/// The rotors' differences, as one stratum of alike sessions has them: which of its directions is likelier
/// with a session variance of its own.
class Differences {
 public:
  Differences(const MixedModel& model, std::size_t stratum)
      : model_(model), stratum_(stratum), sessions_(model, stratum) {}

  /// Of the rotors that are not `found`, in a data set; `alike`: basis of the directions still alike.
  Unlike most_unlike(const Stacked& set, const MatrixXd& alike, const std::vector<Unlike>& found) const {
    const Data in_basis = data(set, alike);
    Unlike most{.split = {.gain = -1}};
    for (Index rotor = 0; rotor < model_.mode_matrix().rows(); ++rotor) {
      if (std::ranges::any_of(found, [&](const Unlike& u) { return u.rotor == rotor; })) continue;
      const VectorXd offset =
          alike.transpose() * model_.mode_matrix().row(rotor).tail(alike.rows()).transpose();
      const Split own = split(in_basis, offset.normalized());
      if (own.gain > most.split.gain) most = {rotor, alike * offset.normalized(), offset.squaredNorm(), own};
    }
    return most;
  }

 private:
  /// One data set, in a basis (modes × k) of directions.
  struct Data {
    MatrixXd left, in_sessions;  // projected at ratio 0: runs × k; session directions × k
  };
  Data data(Stacked column, const MatrixXd& basis) const {
    const Index modes = model_.strata()[stratum_].modes;
    model_.project(stratum_, 0, column);
    const Stacked coordinates = sessions_.coordinates(column);
    return {by_mode(column, modes) * basis, by_mode(coordinates, modes) * basis};
  }

  /// `direction`: in the basis, of length 1. Only a larger variance is asked for.
  Split split(const Data& data, const VectorXd& direction) const {
    const double all_squares = data.left.squaredNorm(), own_squares = (data.left * direction).squaredNorm();
    const double dof = static_cast<double>(model_.dof(stratum_)) /
                       static_cast<double>(model_.strata()[stratum_].modes) *
                       static_cast<double>(direction.size());
    const MatrixXd own = data.in_sessions * direction;
    std::array<double, kRatios.size()> own_rss, others_rss, determinant;
    for (std::size_t r = 0; r < kRatios.size(); ++r) {
      const double own_of_sessions = own.cwiseProduct(sessions_.weighted(r, own)).sum(),
                   of_sessions = data.in_sessions.cwiseProduct(sessions_.weighted(r, data.in_sessions)).sum();
      own_rss[r] = own_squares - own_of_sessions;
      others_rss[r] = all_squares - own_squares - (of_sessions - own_of_sessions);
      determinant[r] =
          model_.log_determinant(stratum_, r) / static_cast<double>(model_.strata()[stratum_].modes);
    }
    const auto others = static_cast<double>(direction.size() - 1);
    double alike = -std::numeric_limits<double>::infinity();
    Split best{-std::numeric_limits<double>::infinity(), 0, 0, 0};
    for (std::size_t b = 0; b < kRatios.size(); ++b)
      for (std::size_t a = b; a < kRatios.size(); ++a) {
        const double all = own_rss[a] + others_rss[b];
        const double likelihood = -0.5 * dof * std::log(all / dof) - determinant[a] - others * determinant[b];
        if (a == b) alike = std::max(alike, likelihood);
        if (likelihood > best.gain) best = {likelihood, a, b, all / dof};
      }
    best.gain -= alike;
    return best;
  }

  const MixedModel& model_;
  const std::size_t stratum_;
  const SessionDirections sessions_;
};

/// Unit vectors that are orthogonal to `direction`, of length 1.
MatrixXd others_than(const VectorXd& direction) {
  MatrixXd columns = MatrixXd::Identity(direction.size(), direction.size());
  columns.col(0) = direction;
  const MatrixXd q = Eigen::HouseholderQR<MatrixXd>(columns).householderQ();
  return q.rightCols(q.cols() - 1);
}

/// In modes, with R the runs' covariance and S that of sessions: W with WᵀRW and WᵀSW diagonal. The
/// first column is the most of what rotors have in common; the last are what the unlike have no part in.
MatrixXd uncorrelated(const MatrixXd& modes, const NullFit& fit, const std::vector<Unlike>& unlike,
                      const MatrixXd& alike) {
  const Index c = modes.cols(), k = static_cast<Index>(unlike.size()) + 1;
  constexpr double kLeast = 1e-9;  // of the variance of the differences: R has an inverse
  const double runs = unlike.back().split.variance,
               common_runs = std::max(std::pow(fit.sigma[0], 2), kLeast * runs);
  const double others = kRatios[unlike.back().split.others] * runs;
  VectorXd of_runs = VectorXd::Constant(c, runs);
  of_runs(0) = common_runs;
  MatrixXd of_sessions = VectorXd::Constant(c, others).asDiagonal();
  double common = kRatios[fit.ratio[0]] * common_runs;
  for (const Unlike& u : unlike) {
    const double more = std::max(0.0, kRatios[u.split.own] * u.split.variance - others) / u.share;
    const RowVectorXd offset = modes.row(u.rotor);
    of_sessions += more * offset.transpose() * offset;
    common -= more * offset(0) * offset(0);
  }
  of_sessions(0, 0) += std::max(0.0, common) - others;
  MatrixXd basis = MatrixXd::Zero(c, c);
  basis(0, 0) = 1;
  for (Index i = 1; i < k; ++i) basis.col(i).tail(c - 1) = unlike[static_cast<std::size_t>(i - 1)].direction;
  basis.bottomRightCorner(c - 1, c - k) = alike;
  const MatrixXd span = basis.leftCols(k);
  const Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd> solver(
      span.transpose() * of_sessions * span, span.transpose() * of_runs.asDiagonal() * span);
  MatrixXd own = solver.eigenvectors();
  Index most = 0;
  own.row(0).cwiseAbs().maxCoeff(&most);
  own.col(0).swap(own.col(most));
  basis.leftCols(k) = span * own.colwise().normalized();
  return basis;
}

}  // namespace

RotorSessions rotor_sessions(const Observations& observations, const std::vector<int>& rows,
                             const Components& residual, std::mt19937_64& random) {
  const MixedModel model(observations, rows);
  const Index channels = observations.channels();
  if (channels < static_cast<Index>(kFewestToCompare) || model.ratios() == 1) return {};
  const std::size_t s = model.differences();
  const NullFit fit = CandidateScan(model, {}, {}).null_fit(residual);
  const Differences differences(model, s);
  const Stacked column = model.stack(s, {&residual});
  const Stacked sets = model.simulate_unit(s, fit.ratio[s], kAlikeSets, model.run_correlation(s), random);
  MatrixXd alike = MatrixXd::Identity(channels - 1, channels - 1);
  std::vector<Unlike> found;
  while (channels - static_cast<Index>(found.size()) >= static_cast<Index>(kFewestToCompare)) {
    const Unlike most = differences.most_unlike(column, alike, found);
    bool by_chance = most.split.gain <= 0;
    for (Index i = 0; i < sets.cols() && !by_chance; ++i)
      by_chance = differences.most_unlike(sets.col(i), alike, found).split.gain >= most.split.gain;
    if (by_chance) break;
    alike = alike * others_than(alike.transpose() * most.direction);
    found.push_back(most);
  }
  if (found.empty()) return {};
  RotorSessions result{.modes = model.mode_matrix() * uncorrelated(model.mode_matrix(), fit, found, alike),
                       .alone = static_cast<int>(found.size()) + 1,
                       .rotors = {}};
  for (const Unlike& unlike : found) result.rotors.push_back(static_cast<int>(unlike.rotor));
  return result;
}

}  // namespace tunnelrig
