#include "analysis/residual/likelihood/mixed_model.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tunnelrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Orthonormal columns, the first along `first`.
MatrixXd orthonormal_from(const VectorXd& first) {
  MatrixXd columns = MatrixXd::Identity(first.size(), first.size());
  columns.col(0) = first;
  return Eigen::HouseholderQR<MatrixXd>(columns).householderQ();
}

/// Rotors that have something in common and each as much of its own: D^(−½) makes what they have of their own
/// alike, and what they have in common a direction, which is the first mode.
MatrixXd modes_of_unlike(const VectorXd& rotor_scatter) {
  const VectorXd one = rotor_scatter.cwiseInverse();
  return one.asDiagonal() * orthonormal_from(one);
}

/// Mean of the rotors, then contrasts. Four rotors: sides, ends, and turning directions against each other.
MatrixXd orthonormal_modes(Index channels) {
  if (channels == 4) {
    MatrixXd modes(4, 4);
    modes << 1, 1, 1, 1, 1, -1, 1, -1, 1, 1, -1, -1, 1, -1, -1, 1;
    return modes / 2;
  }
  return orthonormal_from(VectorXd::Ones(channels));
}

/// (DΦD + a 11ᵀ)^(−½) = (I − share w wᵀ) A D⁻¹, block by block: D⁻¹ divides each run by its scatter, A =
/// Φ^(−½) takes from it what the one before foretells, and w is what both make of 1.
class Root {
 public:
  Root(const std::vector<std::vector<Index>>& blocks, const VectorXd& scatter, double session_ratio,
       double run_correlation)
      : blocks_(blocks),
        inverse_scatter_(scatter.cwiseInverse()),
        session_ratio_(session_ratio),
        correlation_(run_correlation),
        scale_(1 / std::sqrt(1 - run_correlation * run_correlation)),
        w_(inverse_scatter_) {
    squared_norm_.reserve(blocks.size());
    share_.reserve(blocks.size());
    for (const auto& runs : blocks_) {
      foretell(runs, w_);
      double squared_norm = 0;
      for (const Index run : runs) squared_norm += w_(run) * w_(run);
      squared_norm_.push_back(squared_norm);
      share_.push_back((1 - 1 / std::sqrt(1 + session_ratio * squared_norm)) / squared_norm);
    }
  }

  double inverse_scatter(Index run) const { return inverse_scatter_(run); }
  double scale() const { return scale_; }
  double w(Index run) const { return w_(run); }
  /// wᵀw
  double squared_norm(std::size_t block) const { return squared_norm_[block]; }

  void apply(Eigen::Ref<MatrixXd> columns) const {
    columns.array().colwise() *= inverse_scatter_.array();
    for (Index c = 0; c < columns.cols(); ++c)
      for (std::size_t b = 0; b < blocks_.size() && mixes(); ++b) {
        foretell(blocks_[b], columns.col(c));
        shrink(b, columns.col(c));
      }
  }

  void apply_transposed(Eigen::Ref<MatrixXd> columns) const {
    for (Index c = 0; c < columns.cols(); ++c)
      for (std::size_t b = 0; b < blocks_.size() && mixes(); ++b) {
        const auto& runs = blocks_[b];
        shrink(b, columns.col(c));
        for (std::size_t k = 0; k < runs.size() && correlation_ != 0; ++k) {
          if (k > 0) columns(runs[k], c) *= scale_;
          if (k + 1 < runs.size()) columns(runs[k], c) -= scale_ * correlation_ * columns(runs[k + 1], c);
        }
      }
    columns.array().colwise() *= inverse_scatter_.array();
  }

 private:
  bool mixes() const { return session_ratio_ != 0 || correlation_ != 0; }  // the runs of a block
  void foretell(const std::vector<Index>& runs, Eigen::Ref<VectorXd> column) const {
    for (std::size_t k = runs.size() - 1; k > 0 && correlation_ != 0; --k)
      column(runs[k]) = scale_ * (column(runs[k]) - correlation_ * column(runs[k - 1]));
  }
  void shrink(std::size_t block, Eigen::Ref<VectorXd> column) const {
    if (session_ratio_ == 0) return;
    double sum = 0;
    for (const Index run : blocks_[block]) sum += w_(run) * column(run);
    sum *= share_[block];
    for (const Index run : blocks_[block]) column(run) -= sum * w_(run);
  }

  const std::vector<std::vector<Index>>& blocks_;
  VectorXd inverse_scatter_;
  double session_ratio_, correlation_, scale_;
  VectorXd w_;
  std::vector<double> squared_norm_, share_;  // of each block
};

}  // namespace

MatrixXd modes_of(const RunScatter& scatter, Index channels) {
  MatrixXd modes = scatter.sessions.modes.size() > 0 ? scatter.sessions.modes
                   : scatter.rotors.size() > 0       ? modes_of_unlike(scatter.rotors)
                                                     : orthonormal_modes(channels);
  if (modes(0, 0) < 0) modes *= -1;
  return modes;
}

void whiten(const std::vector<std::vector<Index>>& blocks, const VectorXd& scatter, double session_ratio,
            double run_correlation,
            Eigen::Ref<MatrixXd> columns) {  // NOLINT(performance-unnecessary-value-param): written through
  Root(blocks, scatter, session_ratio, run_correlation).apply(columns);
}

MixedModel::MixedModel(const Observations& observations, std::vector<int> rows,
                       const std::vector<std::size_t>& ratio)
    : MixedModel(observations, std::move(rows), ratio, observations.scatter) {}

MixedModel MixedModel::baseline_alone(const Observations& observations, std::vector<int> rows) {
  return {observations,
          std::move(rows),
          {0},
          {.rotors = observations.scatter.rotors,
           .contrasts = observations.scatter.contrasts,
           .sessions = observations.scatter.sessions}};
}

MixedModel::MixedModel(const Observations& observations, std::vector<int> rows,
                       const std::vector<std::size_t>& ratio, const RunScatter& scatter)
    : observations_(observations),
      rows_(std::move(rows)),
      modes_(modes_of(scatter, observations.channels())),
      run_correlation_(scatter.run_correlation),
      alike_(VectorXd::Ones(static_cast<Index>(rows_.size()))),
      scatter_(scatter.of_runs(rows_)) {
  rotors_of_modes_ = scatter.rotors_differ() ? MatrixXd(modes_.inverse()) : modes_.transpose();
  const int channels = static_cast<int>(observations.channels()),
            alone = scatter.contrasts.size() > 0 ? channels : scatter.sessions.alone;
  for (std::size_t component = 0; component <= observations.shape.size(); ++component) {
    for (int mode = 0; mode < alone; ++mode) strata_.push_back({component, mode, 1});
    if (channels > alone) strata_.push_back({component, alone, channels - alone});
  }
  if (observations.blocks_are_rows) ratios_ = 1;
  blocks_ = without_numbers(places_of_each(observations.block, rows_));
  set_groups();
  const bool alike = observations.channels() == 1 || run_correlation_[0] == run_correlation_[1];
  std::set<std::size_t> wanted(ratio.begin(), ratio.end());
  for (std::size_t r = 0; r < ratios_ && ratio.empty(); ++r) wanted.insert(r);
  for (std::size_t side = 0; side < (alike ? 1U : 2U); ++side) {
    const NormalParts parts = normal_parts(run_correlation_[side]);
    prepared_[side] = prepare(parts, run_correlation_[side], wanted);
    with_blocks_[side].resize(columns_, std::ssize(blocks_));
    with_blocks_[side].setFromTriplets(parts.of_blocks.begin(), parts.of_blocks.end());
    block_squares_[side] = parts.blocks;
  }
  log_determinant_.assign(strata_.size(), std::vector<double>(ratios_));
  for (std::size_t s = 0; s < strata_.size(); ++s)
    for (const std::size_t r : wanted) log_determinant_[s][r] = make_log_determinant(s, r);
}

std::size_t MixedModel::differences() const {
  std::size_t s = 0;
  while (!strata_[s].means() || strata_[s].side() == 0) ++s;
  return s;
}

double MixedModel::run_correlation(std::size_t stratum) const {
  return strata_[stratum].means() ? run_correlation_[strata_[stratum].side()] : 0;
}

const MixedModel::Prepared& MixedModel::prepared(std::size_t stratum, std::size_t ratio) const {
  return prepared_[prepared_side(stratum)][ratio];
}

void MixedModel::set_groups() {
  const Index each = 1 + observations_.slopes.cols();
  first_column_.resize(rows_.size());
  own_ = MatrixXd::Zero(static_cast<Index>(rows_.size()), each);
  for (const auto& [number, places] : places_of_each(observations_.group, rows_)) {
    std::vector<int> rows;
    for (const Index place : places) rows.push_back(rows_[static_cast<std::size_t>(place)]);
    const Eigen::ColPivHouseholderQR<MatrixXd> qr(observations_.baseline_columns(rows));
    const Index rank = qr.rank();
    const MatrixXd r = qr.matrixQR().topLeftCorner(rank, rank).triangularView<Eigen::Upper>();
    GroupBaseline& group = groups_[number];
    group.first = columns_;
    group.to_orthonormal = MatrixXd::Zero(each, each);
    group.to_orthonormal.leftCols(rank) =
        MatrixXd(qr.colsPermutation()).leftCols(rank) *
        r.triangularView<Eigen::Upper>().solve(MatrixXd::Identity(rank, rank));
    // Not by to_orthonormal: of a slope that is nearly constant its product is not orthonormal, and a
    // projection by it none.
    const MatrixXd orthonormal = qr.householderQ() * MatrixXd::Identity(std::ssize(rows), rank);
    own_(places, Eigen::seqN(0, rank)) = orthonormal;
    for (const Index place : places) first_column_[static_cast<std::size_t>(place)] = columns_;
    log_of_groups_ += 2 * r.diagonal().array().abs().log().sum();
    columns_ += each;
    baseline_columns_ += rank;
  }
}

Eigen::RowVectorXd MixedModel::baseline_row(const GroupBaseline& group, int row) const {
  return observations_.baseline_columns(std::array{row}) * group.to_orthonormal;
}

NormalParts MixedModel::normal_parts(double run_correlation) const {
  const Root root(blocks_, scatter_, 0, run_correlation);
  const Index each = own_.cols();
  NormalParts parts{.columns = columns_, .blocks = VectorXd(static_cast<Index>(blocks_.size()))};
  struct Entry {
    Index first;
    Eigen::RowVectorXd values;
  };
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    parts.blocks(static_cast<Index>(b)) = root.squared_norm(b);
    for (std::size_t k = 0; k < blocks_[b].size(); ++k) {
      std::vector<Entry> row;  // of A D⁻¹ L: a run less a part of the one before it
      const auto add = [&](Index run, double weight) {
        row.push_back({first_column_[static_cast<std::size_t>(run)],
                       weight * root.inverse_scatter(run) * own_.row(run)});
      };
      add(blocks_[b][k], k == 0 ? 1 : root.scale());
      if (k > 0 && run_correlation != 0) add(blocks_[b][k - 1], -run_correlation * root.scale());
      for (const Entry& one : row)
        for (Index i = 0; i < each; ++i) {
          parts.of_blocks.emplace_back(one.first + i, b, root.w(blocks_[b][k]) * one.values(i));
          for (const Entry& other : row)
            for (Index j = 0; j < each; ++j)
              parts.independent.emplace_back(one.first + i, other.first + j, one.values(i) * other.values(j));
        }
    }
  }
  for (const auto& [number, group] : groups_)
    for (Index k = 0; k < each; ++k)
      if (group.to_orthonormal.col(k).isZero(0))
        parts.independent.emplace_back(group.first + k, group.first + k, 1);
  return parts;
}

std::vector<MixedModel::Prepared> MixedModel::prepare(const NormalParts& parts, double run_correlation,
                                                      const std::set<std::size_t>& ratio) const {
  std::vector<Prepared> result(ratios_);
  for (const std::size_t r : ratio) {
    result[r].log_xvx = log_of_groups_;
    if (kRatios[r] == 0 && run_correlation == 0 && (scatter_.array() == 1).all()) continue;
    result[r].normal.emplace(parts, kRatios[r]);
    result[r].log_xvx += result[r].normal->log_determinant();
  }
  return result;
}

MatrixXd MixedModel::baseline_coefficients(std::size_t stratum, std::size_t ratio, MatrixXd whitened) const {
  Root(blocks_, run_scatter(stratum), kRatios[ratio], run_correlation(stratum)).apply_transposed(whitened);
  MatrixXd result = MatrixXd::Zero(columns_, whitened.cols());
  for (Index c = 0; c < whitened.cols(); ++c)
    for (Index k = 0; k < own_.cols(); ++k)
      for (Index run = 0; run < whitened.rows(); ++run)
        result(first_column_[static_cast<std::size_t>(run)] + k, c) += own_(run, k) * whitened(run, c);
  if (const auto& normal = prepared(stratum, ratio).normal) return normal->solve(result);
  return result;
}

Index MixedModel::dof(std::size_t stratum) const {
  const Index runs = static_cast<Index>(rows_.size()) - (strata_[stratum].means() ? baseline_columns_ : 0);
  return runs * strata_[stratum].modes;
}

double MixedModel::make_log_determinant(std::size_t stratum, std::size_t ratio) const {
  const double correlation = run_correlation(stratum);
  const Root root(blocks_, run_scatter(stratum), kRatios[ratio], correlation);
  double log_v = 2 * run_scatter(stratum).array().log().sum();
  for (std::size_t b = 0; b < blocks_.size(); ++b)
    log_v += static_cast<double>(blocks_[b].size() - 1) * std::log(1 - correlation * correlation) +
             std::log1p(kRatios[ratio] * root.squared_norm(b));
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
  const Root root(blocks_, run_scatter(stratum), kRatios[ratio], run_correlation(stratum));
  if (strata_[stratum].means()) {
    MatrixXd whitened = by_mode;
    root.apply(whitened);
    const MatrixXd coefficients = baseline_coefficients(stratum, ratio, std::move(whitened));
    for (Index c = 0; c < by_mode.cols(); ++c)
      for (Index k = 0; k < own_.cols(); ++k)
        for (Index run = 0; run < n; ++run)
          by_mode(run, c) -= own_(run, k) * coefficients(first_column_[static_cast<std::size_t>(run)] + k, c);
  }
  root.apply(by_mode);
}

bool MixedModel::sees(const Components& column) const {
  double before = 0, after = 0;
  for (std::size_t s = 0; s < strata_.size(); ++s) {
    Stacked stacked = stack(s, {&column});
    before += stacked.squaredNorm();
    project(s, 0, stacked);
    after += stacked.squaredNorm();
  }
  return after > 1e-14 * before && after > 0;
}

Stacked MixedModel::baseline_prediction(std::size_t stratum, std::size_t ratio, const Stacked& columns,
                                        const std::vector<int>& rows) const {
  const Index n = static_cast<Index>(rows_.size()), wanted = static_cast<Index>(rows.size());
  const Index modes = strata_[stratum].modes;
  Stacked result = Stacked::Zero(wanted * modes, columns.cols());
  if (!strata_[stratum].means()) return result;
  MatrixXd by_mode = Eigen::Map<const MatrixXd>(columns.data(), n, modes * columns.cols());
  whiten(blocks_, run_scatter(stratum), kRatios[ratio], run_correlation(stratum), by_mode);
  const MatrixXd coefficients = baseline_coefficients(stratum, ratio, std::move(by_mode));
  Eigen::Map<MatrixXd> predicted(result.data(), wanted, modes * columns.cols());
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const auto group = groups_.find(observations_.group[static_cast<std::size_t>(rows[r])]);
    if (group == groups_.end())
      predicted.row(static_cast<Index>(r)).setConstant(std::numeric_limits<double>::quiet_NaN());
    else
      predicted.row(static_cast<Index>(r)) =
          baseline_row(group->second, rows[r]) * coefficients.middleRows(group->second.first, own_.cols());
  }
  return result;
}

Eigen::VectorXd MixedModel::baseline_variance(std::size_t stratum, std::size_t ratio,
                                              const std::vector<int>& rows) const {
  Eigen::VectorXd result = Eigen::VectorXd::Zero(static_cast<Index>(rows.size()));
  if (!strata_[stratum].means()) return result;
  const auto& normal = prepared(stratum, ratio).normal;
  std::map<int, MatrixXd> covariance;  // the group's block of (LᵀV⁻¹L)⁻¹
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const auto group = groups_.find(observations_.group[static_cast<std::size_t>(rows[r])]);
    double& variance = result(static_cast<Index>(r));
    if (group == groups_.end()) {
      variance = std::numeric_limits<double>::quiet_NaN();
      continue;
    }
    const auto [known, fresh] = covariance.try_emplace(group->first);
    if (fresh && !normal) {
      known->second.setIdentity(own_.cols(), own_.cols());
    } else if (fresh) {
      const Index first = group->second.first, count = own_.cols();
      known->second = normal->inverse_columns(first, count).middleRows(first, count);
    }
    const Eigen::RowVectorXd row = baseline_row(group->second, rows[r]);
    variance = row.dot(row * known->second);
  }
  return result;
}

}  // namespace tunnelrig
