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

/// Φ^(−½) makes a block's 1 to (1, w, w, …).
double weight_of_later(double run_correlation) {
  return run_correlation == 0 ? 1 : std::sqrt((1 - run_correlation) / (1 + run_correlation));
}

}  // namespace

void whiten(const std::vector<std::vector<Index>>& blocks, double session_ratio, double run_correlation,
            Eigen::Ref<MatrixXd> columns) {
  // Φ^(−½) takes from each run what the one before it foretells.
  const double scale = 1 / std::sqrt(1 - run_correlation * run_correlation);
  const double w = weight_of_later(run_correlation);
  Eigen::RowVectorXd mean(columns.cols());
  for (const auto& runs : blocks) {
    if (run_correlation != 0)
      for (std::size_t k = runs.size() - 1; k > 0; --k)
        columns.row(runs[k]) = scale * (columns.row(runs[k]) - run_correlation * columns.row(runs[k - 1]));
    if (session_ratio == 0) continue;
    const double n = 1 + w * w * static_cast<double>(runs.size() - 1);
    const double share = (1 - 1 / std::sqrt(1 + session_ratio * n)) / n;
    mean = columns.row(runs[0]);
    for (std::size_t k = 1; k < runs.size(); ++k) mean += w * columns.row(runs[k]);
    mean *= share;
    columns.row(runs[0]) -= mean;
    for (std::size_t k = 1; k < runs.size(); ++k) columns.row(runs[k]) -= w * mean;
  }
}

MixedModel::MixedModel(const Observations& observations, std::vector<int> rows,
                       const std::vector<std::size_t>& ratio)
    : MixedModel(observations, std::move(rows), ratio, observations.run_correlation) {}

MixedModel MixedModel::baseline_alone(const Observations& observations, std::vector<int> rows) {
  return {observations, std::move(rows), {0}, {0, 0}};
}

MixedModel::MixedModel(const Observations& observations, std::vector<int> rows,
                       const std::vector<std::size_t>& ratio, const std::array<double, 2>& run_correlation)
    : observations_(observations),
      rows_(std::move(rows)),
      modes_(orthonormal_modes(observations.channels())),
      run_correlation_(run_correlation) {
  if (modes_(0, 0) < 0) modes_ *= -1;
  for (std::size_t component = 0; component <= observations.shape.size(); ++component) {
    strata_.push_back({component, 0, 1});
    if (observations.channels() > 1)
      strata_.push_back({component, 1, static_cast<int>(observations.channels()) - 1});
  }
  std::map<int, std::vector<Index>> blocks;
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    blocks[observations.block[static_cast<std::size_t>(rows_[r])]].push_back(static_cast<Index>(r));
  }
  if (observations.blocks_are_rows) ratios_ = 1;
  for (auto& [block, runs] : blocks) blocks_.push_back(std::move(runs));
  const bool alike = observations.channels() == 1 || run_correlation_[0] == run_correlation_[1];
  const auto wanted = [&](std::size_t r) {
    return ratio.empty() || std::find(ratio.begin(), ratio.end(), r) != ratio.end();
  };
  for (std::size_t s = 0; s < (alike ? 1U : 2U); ++s) {
    prepared_[s].resize(ratios_);
    for (std::size_t r = 0; r < ratios_; ++r)
      if (wanted(r)) prepared_[s][r] = prepare(r, run_correlation_[s]);
  }
  log_determinant_.assign(strata_.size(), std::vector<double>(ratios_));
  for (std::size_t s = 0; s < strata_.size(); ++s)
    for (std::size_t r = 0; r < ratios_; ++r)
      if (wanted(r)) log_determinant_[s][r] = make_log_determinant(s, r);
}

double MixedModel::run_correlation(std::size_t stratum) const {
  return strata_[stratum].means() ? run_correlation_[strata_[stratum].side()] : 0;
}

const MixedModel::Prepared& MixedModel::prepared(std::size_t stratum, std::size_t ratio) const {
  return prepared_[prepared_[1].empty() ? 0 : strata_[stratum].side()][ratio];
}

MatrixXd MixedModel::baseline_of(const std::vector<int>& rows, const std::vector<int>& groups) const {
  const Index each = 1 + observations_.slopes.cols();
  MatrixXd baseline =
      MatrixXd::Zero(static_cast<Index>(rows.size()), static_cast<Index>(groups.size()) * each);
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const auto row = static_cast<Index>(r);
    const int own = observations_.group[static_cast<std::size_t>(rows[r])];
    const auto group = std::lower_bound(groups.begin(), groups.end(), own);
    if (group == groups.end() || *group != own) {
      baseline.row(row).setConstant(std::numeric_limits<double>::quiet_NaN());
      continue;
    }
    const Index first = (group - groups.begin()) * each;
    baseline(row, first) = 1;
    baseline.row(row).segment(first + 1, each - 1) = observations_.slopes.row(rows[r]);
  }
  return baseline;
}

MixedModel::Part MixedModel::decompose(std::size_t ratio, double run_correlation, std::vector<Index> runs,
                                       std::vector<int> groups) const {
  std::vector<int> rows;
  for (const Index run : runs) rows.push_back(rows_[static_cast<std::size_t>(run)]);
  MatrixXd baseline = baseline_of(rows, groups);
  if (ratio > 0 || run_correlation != 0)  // then the part holds all runs
    whiten(blocks_, kRatios[ratio], run_correlation, baseline);
  Part part{.runs = std::move(runs),
            .groups = std::move(groups),
            .qr = baseline.colPivHouseholderQr(),
            .basis = {}};
  // Slopes may be collinear with the constants: only the columns of full rank count.
  part.basis = part.qr.householderQ() * MatrixXd::Identity(baseline.rows(), part.qr.rank());
  return part;
}

MixedModel::Prepared MixedModel::prepare(std::size_t ratio, double run_correlation) {
  std::map<int, std::vector<Index>> runs_of_group;
  for (std::size_t r = 0; r < rows_.size(); ++r)
    runs_of_group[observations_.group[static_cast<std::size_t>(rows_[r])]].push_back(static_cast<Index>(r));
  Prepared prepared;
  if (ratio == 0 && run_correlation == 0) {  // each group stands for itself: small systems, not one large one
    for (const auto& [group, runs] : runs_of_group)
      prepared.parts.push_back(decompose(ratio, run_correlation, runs, {group}));
  } else {
    std::vector<Index> all(rows_.size());
    std::iota(all.begin(), all.end(), Index{0});
    std::vector<int> groups;
    for (const auto& [group, runs] : runs_of_group) groups.push_back(group);
    prepared.parts.push_back(decompose(ratio, run_correlation, std::move(all), std::move(groups)));
  }
  baseline_columns_ = 0;
  for (const Part& part : prepared.parts) {
    baseline_columns_ += part.basis.cols();
    prepared.log_xvx += 2 * part.qr.matrixQR().diagonal().head(part.basis.cols()).array().abs().log().sum();
  }
  return prepared;
}

std::vector<Index> MixedModel::rows_of(const Part& part, const std::vector<int>& rows) const {
  std::vector<Index> result;
  for (std::size_t r = 0; r < rows.size(); ++r)
    if (std::binary_search(part.groups.begin(), part.groups.end(),
                           observations_.group[static_cast<std::size_t>(rows[r])]))
      result.push_back(static_cast<Index>(r));
  return result;
}

Index MixedModel::dof(std::size_t stratum) const {
  const Index runs = static_cast<Index>(rows_.size()) - (strata_[stratum].means() ? baseline_columns_ : 0);
  return runs * strata_[stratum].modes;
}

double MixedModel::make_log_determinant(std::size_t stratum, std::size_t ratio) const {
  const double correlation = run_correlation(stratum), less = 1 - correlation * correlation;
  const double w = weight_of_later(correlation);
  double log_v = 0;
  for (const auto& runs : blocks_) {
    const auto after_first = static_cast<double>(runs.size() - 1);
    log_v += after_first * std::log(less) + std::log1p(kRatios[ratio] * (1 + w * w * after_first));
  }
  return 0.5 * strata_[stratum].modes *
         (log_v + (strata_[stratum].means() ? prepared(stratum, ratio).log_xvx : 0));
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
  whiten(blocks_, kRatios[ratio], run_correlation(stratum), by_mode);
  if (!strata_[stratum].means()) return;
  const auto& parts = prepared(stratum, ratio).parts;
  if (parts.size() == 1) {
    by_mode.noalias() -= parts[0].basis * (parts[0].basis.transpose() * by_mode);
    return;
  }
  for (const Part& part : parts) {
    const MatrixXd own = by_mode(part.runs, Eigen::all);
    by_mode(part.runs, Eigen::all) -= part.basis * (part.basis.transpose() * own);
  }
}

Stacked MixedModel::baseline_prediction(std::size_t stratum, std::size_t ratio, const Stacked& columns,
                                        const std::vector<int>& rows) const {
  const Index n = static_cast<Index>(rows_.size()), wanted = static_cast<Index>(rows.size());
  const Index modes = strata_[stratum].modes;
  Stacked result = Stacked::Zero(wanted * modes, columns.cols());
  if (!strata_[stratum].means()) return result;
  result.setConstant(std::numeric_limits<double>::quiet_NaN());
  MatrixXd by_mode = Eigen::Map<const MatrixXd>(columns.data(), n, modes * columns.cols());
  whiten(blocks_, kRatios[ratio], run_correlation(stratum), by_mode);
  Eigen::Map<MatrixXd> predicted(result.data(), wanted, modes * columns.cols());
  for (const Part& part : prepared(stratum, ratio).parts) {
    const std::vector<Index> where = rows_of(part, rows);
    if (where.empty()) continue;
    std::vector<int> asked;
    for (const Index r : where) asked.push_back(rows[static_cast<std::size_t>(r)]);
    predicted(where, Eigen::all) =
        baseline_of(asked, part.groups) * part.qr.solve(MatrixXd(by_mode(part.runs, Eigen::all)));
  }
  return result;
}

Eigen::VectorXd MixedModel::baseline_variance(std::size_t stratum, std::size_t ratio,
                                              const std::vector<int>& rows) const {
  if (!strata_[stratum].means()) return Eigen::VectorXd::Zero(static_cast<Index>(rows.size()));
  Eigen::VectorXd result =
      Eigen::VectorXd::Constant(static_cast<Index>(rows.size()), std::numeric_limits<double>::quiet_NaN());
  for (const Part& part : prepared(stratum, ratio).parts) {
    const std::vector<Index> where = rows_of(part, rows);
    if (where.empty()) continue;
    std::vector<int> asked;
    for (const Index r : where) asked.push_back(rows[static_cast<std::size_t>(r)]);
    // L_row (LᵀV⁻¹L)⁻¹ L_rowᵀ with LᵀV⁻¹L = P RᵀR Pᵀ
    const Index rank = part.basis.cols();
    const MatrixXd r = part.qr.matrixQR().topLeftCorner(rank, rank).triangularView<Eigen::Upper>();
    const MatrixXd permuted = (baseline_of(asked, part.groups) * part.qr.colsPermutation()).leftCols(rank);
    const MatrixXd half = r.transpose().triangularView<Eigen::Lower>().solve(permuted.transpose());
    result(where) = half.colwise().squaredNorm().transpose();
  }
  return result;
}

Stacked MixedModel::simulate(std::size_t stratum, const std::vector<double>& sigma,
                             const std::vector<std::size_t>& ratio, double run_correlation,
                             std::mt19937_64& random) const {
  std::normal_distribution<double> normal;
  const Index n = static_cast<Index>(rows_.size());
  const double fresh = std::sqrt(1 - run_correlation * run_correlation);
  Stacked result(n * strata_[stratum].modes, static_cast<Index>(sigma.size()));
  for (Index i = 0; i < result.cols(); ++i) {
    for (Index k = 0; k < result.rows(); ++k) result(k, i) = normal(random);
    Eigen::Map<MatrixXd> modes(result.col(i).data(), n, strata_[stratum].modes);
    const double session = std::sqrt(kRatios[ratio[static_cast<std::size_t>(i)]]);
    for (Index mode = 0; mode < modes.cols(); ++mode) {
      for (const auto& runs : blocks_) {
        for (std::size_t k = 1; k < runs.size() && run_correlation != 0; ++k)
          modes(runs[k], mode) = run_correlation * modes(runs[k - 1], mode) + fresh * modes(runs[k], mode);
        const double offset = session * normal(random);
        for (const Index run : runs) modes(run, mode) += offset;
      }
    }
    result.col(i) *= sigma[static_cast<std::size_t>(i)];
  }
  return result;
}

}  // namespace tunnelrig
