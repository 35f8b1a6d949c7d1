#include "analysis/residual/mixed_model.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tunnelrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/// Mean of the rotors, then contrasts. Four rotors: sides, ends, and turning directions against each other.
MatrixXd orthonormal_modes(Index channels) {
  if (channels == 4) {
    MatrixXd modes(4, 4);
    modes << 1, 1, 1, 1, 1, -1, 1, -1, 1, 1, -1, -1, 1, -1, -1, 1;
    return modes / 2;
  }
  MatrixXd modes = MatrixXd::Identity(channels, channels);
  modes.col(0).setConstant(1);
  return Eigen::HouseholderQR<MatrixXd>(modes).householderQ();
}

}  // namespace

MixedModel::MixedModel(const Observations& observations, std::vector<int> rows,
                       const std::vector<std::size_t>& ratio)
    : observations_(observations),
      rows_(std::move(rows)),
      modes_(orthonormal_modes(observations.channels())) {
  if (modes_(0, 0) < 0) modes_ *= -1;
  for (std::size_t component = 0; component <= observations.shape.size(); ++component) {
    strata_.push_back({component, 0, 1});
    if (observations.channels() > 1)
      strata_.push_back({component, 1, static_cast<int>(observations.channels()) - 1});
  }
  std::map<int, std::vector<Index>> blocks;
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    blocks[observations.block[static_cast<std::size_t>(rows_[r])]].push_back(static_cast<Index>(r));
    groups_.emplace(observations.group[static_cast<std::size_t>(rows_[r])],
                    static_cast<Index>(groups_.size()));
  }
  if (observations.blocks_are_rows) ratios_ = 1;
  for (auto& [block, runs] : blocks) blocks_.push_back(std::move(runs));
  prepared_.resize(ratios_);
  for (std::size_t r = 0; r < ratios_; ++r)
    if (ratio.empty() || std::find(ratio.begin(), ratio.end(), r) != ratio.end()) prepare(r);
}

MatrixXd MixedModel::baseline_of(const std::vector<int>& rows) const {
  MatrixXd baseline = MatrixXd::Zero(static_cast<Index>(rows.size()),
                                     static_cast<Index>(groups_.size()) + observations_.slopes.cols());
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const auto row = static_cast<Index>(r);
    const auto group = groups_.find(observations_.group[static_cast<std::size_t>(rows[r])]);
    if (group == groups_.end()) {
      baseline.row(row).setConstant(std::numeric_limits<double>::quiet_NaN());
      continue;
    }
    baseline(row, group->second) = 1;
    baseline.row(row).tail(observations_.slopes.cols()) = observations_.slopes.row(rows[r]);
  }
  return baseline;
}

void MixedModel::prepare(std::size_t ratio) {
  MatrixXd whitened = baseline_of(rows_);
  whiten(ratio, whitened);
  // Slopes may be collinear with the groups' constants: only the columns of full rank count.
  Prepared& p = prepared_[ratio];
  p.qr.compute(whitened);
  baseline_columns_ = p.qr.rank();
  p.basis = p.qr.householderQ() * MatrixXd::Identity(whitened.rows(), baseline_columns_);
  p.log_xvx = 2 * p.qr.matrixQR().diagonal().head(baseline_columns_).array().abs().log().sum();
  for (const auto& runs : blocks_) p.log_v += std::log1p(kRatios[ratio] * static_cast<double>(runs.size()));
}

/// V^(−½) block by block: I − (1 − 1/√(1 + a n)) 11ᵀ/n.
void MixedModel::whiten(std::size_t ratio, Eigen::Ref<MatrixXd> columns) const {
  if (kRatios[ratio] == 0) return;
  Eigen::RowVectorXd mean(columns.cols());
  for (const auto& runs : blocks_) {
    const double n = static_cast<double>(runs.size());
    const double share = 1 - 1 / std::sqrt(1 + kRatios[ratio] * n);
    mean.setZero();
    for (const Index run : runs) mean += columns.row(run);
    mean *= share / n;
    for (const Index run : runs) columns.row(run) -= mean;
  }
}

Index MixedModel::dof(std::size_t stratum) const {
  const Index runs = static_cast<Index>(rows_.size()) - (strata_[stratum].means() ? baseline_columns_ : 0);
  return runs * strata_[stratum].modes;
}

double MixedModel::log_determinant(std::size_t stratum, std::size_t ratio) const {
  const double one_mode = prepared_[ratio].log_v + (strata_[stratum].means() ? prepared_[ratio].log_xvx : 0);
  return 0.5 * strata_[stratum].modes * one_mode;
}

Stacked MixedModel::stack(std::size_t stratum, const std::vector<const Components*>& items) const {
  const Stratum& s = strata_[stratum];
  const Index n = static_cast<Index>(rows_.size());
  Stacked result(n * s.modes, static_cast<Index>(items.size()));
  for (std::size_t i = 0; i < items.size(); ++i) {
    const MatrixXd picked = (*items[i])[s.component](rows_, Eigen::all);
    Eigen::Map<MatrixXd>(result.col(static_cast<Index>(i)).data(), n, s.modes) =
        picked * modes_.middleCols(s.first_mode, s.modes);
  }
  return result;
}

void MixedModel::project(std::size_t stratum, std::size_t ratio, Stacked& columns) const {
  const Index n = static_cast<Index>(rows_.size());
  Eigen::Map<MatrixXd> by_mode(columns.data(), n, columns.size() / n);
  whiten(ratio, by_mode);
  if (strata_[stratum].means()) {
    const MatrixXd absorbed = prepared_[ratio].basis.transpose() * by_mode;
    by_mode.noalias() -= prepared_[ratio].basis * absorbed;
  }
}

Stacked MixedModel::baseline_prediction(std::size_t stratum, std::size_t ratio, const Stacked& columns,
                                        const std::vector<int>& rows) const {
  const Index n = static_cast<Index>(rows_.size()), wanted = static_cast<Index>(rows.size());
  const Index modes = strata_[stratum].modes;
  Stacked result = Stacked::Zero(wanted * modes, columns.cols());
  if (!strata_[stratum].means()) return result;
  MatrixXd by_mode = Eigen::Map<const MatrixXd>(columns.data(), n, modes * columns.cols());
  whiten(ratio, by_mode);
  Eigen::Map<MatrixXd>(result.data(), wanted, modes * columns.cols()) =
      baseline_of(rows) * prepared_[ratio].qr.solve(by_mode);
  return result;
}

Eigen::VectorXd MixedModel::baseline_variance(std::size_t stratum, std::size_t ratio,
                                              const std::vector<int>& rows) const {
  if (!strata_[stratum].means()) return Eigen::VectorXd::Zero(static_cast<Index>(rows.size()));
  const Prepared& p = prepared_[ratio];
  // L_row (LᵀV⁻¹L)⁻¹ L_rowᵀ with LᵀV⁻¹L = P RᵀR Pᵀ
  const MatrixXd r =
      p.qr.matrixQR().topLeftCorner(baseline_columns_, baseline_columns_).triangularView<Eigen::Upper>();
  const MatrixXd permuted = (baseline_of(rows) * p.qr.colsPermutation()).leftCols(baseline_columns_);
  const MatrixXd half = r.transpose().triangularView<Eigen::Lower>().solve(permuted.transpose());
  return half.colwise().squaredNorm().transpose();
}

Stacked MixedModel::simulate(std::size_t stratum, const std::vector<double>& sigma,
                             const std::vector<std::size_t>& ratio, std::mt19937_64& random) const {
  std::normal_distribution<double> normal;
  const Index n = static_cast<Index>(rows_.size());
  Stacked result(n * strata_[stratum].modes, static_cast<Index>(sigma.size()));
  for (Index i = 0; i < result.cols(); ++i) {
    for (Index k = 0; k < result.rows(); ++k) result(k, i) = normal(random);
    Eigen::Map<MatrixXd> modes(result.col(i).data(), n, strata_[stratum].modes);
    const double session = std::sqrt(kRatios[ratio[static_cast<std::size_t>(i)]]);
    for (Index mode = 0; mode < modes.cols(); ++mode) {
      for (const auto& runs : blocks_) {
        const double offset = session * normal(random);
        for (const Index run : runs) modes(run, mode) += offset;
      }
    }
    result.col(i) *= sigma[static_cast<std::size_t>(i)];
  }
  return result;
}

}  // namespace tunnelrig
