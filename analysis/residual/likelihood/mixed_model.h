// The random part of the model: runs and sessions scatter, rotors together and against each other.
//
//   y = (group's constant, free per rotor) + terms + session + run
//
// The rotors' y are rotated into one common and c − 1 difference modes (each rotor's first divided by its
// scatter, where they differ in it; of rotors whose sessions differ more, each has a mode of its own, and so
// have contrasts that scatter unlike each other); the runs' means and each cosine coefficient of their
// course, common or difference, make a stratum with a run variance σ² and a session variance a σ² of its own.
// A run's mean may be correlated with that of the run before it by φ, and scatter d times as much as most: V
// = σ² (DΦD + a 11ᵀ) in each session, Φ_ij = φ^|i − j|, D = diag(d). docs/closed-loop-method.md has the
// equations.
#pragma once

#include "analysis/residual/likelihood/baseline_normal.h"
#include "analysis/residual/likelihood/terms.h"

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <random>
#include <set>
#include <vector>

#include <Eigen/Dense>

namespace tunnelrig {

/// Session variance over run variance, where it is searched.
inline constexpr std::array<double, 9> kRatios = {0, 0.05, 0.15, 0.4, 1, 2.5, 6, 15, 60};

/// Columns, each stacked over the modes of one stratum: (runs · modes) × columns.
using Stacked = Eigen::MatrixXd;

/// A stacked column as runs × modes.
inline auto by_mode(const Stacked& column, Eigen::Index modes) {
  return column.reshaped(column.size() / modes, modes);
}

/// By which rows of `channels` rotors are multiplied, where they scatter like that: MixedModel::mode_matrix.
Eigen::MatrixXd modes_of(const RunScatter& scatter, Eigen::Index channels);

/// (DΦD + a 11ᵀ)^(−½), by which columns (a row for each run) are multiplied in place, block by block; the
/// runs of a block in order of time. `scatter`: d of each row.
void whiten(const std::vector<std::vector<Eigen::Index>>& blocks, const Eigen::VectorXd& scatter,
            double session_ratio, double run_correlation, Eigen::Ref<Eigen::MatrixXd> columns);

/// What is fixed by the design and the correlation of neighbouring runs: for some runs of some observations.
class MixedModel {
 public:
  struct Stratum {
    std::size_t component = 0;  // 0: the runs' means; j: their course's j-th cosine
    int first_mode = 0, modes = 1;
    bool means() const { return component == 0; }
    /// Common (or the most of it, where a rotor's sessions differ more), differences.
    std::size_t side() const { return first_mode == 0 ? 0 : 1; }
  };

  /// `ratio`: only these ratios are prepared (of each stratum); empty: all.
  MixedModel(const Observations& observations, std::vector<int> rows,
             const std::vector<std::size_t>& ratio = {});

  /// Runs of one variance, independent of each other: only to take out what the baseline can absorb.
  static MixedModel baseline_alone(const Observations& observations, std::vector<int> rows);

  const std::vector<int>& rows() const { return rows_; }
  const std::vector<std::vector<Eigen::Index>>& blocks() const { return blocks_; }  // positions in rows()
  const std::vector<Stratum>& strata() const { return strata_; }
  /// Of the runs' means, the stratum of what rotors differ by; there are two rotors at least.
  std::size_t differences() const;
  Eigen::Index dof(std::size_t stratum) const;  // runs · modes less the baseline's
  /// Restricted likelihood's constant, ½ log(…).
  double log_determinant(std::size_t stratum, std::size_t ratio) const {
    return log_determinant_[stratum][ratio];
  }
  std::size_t ratios() const { return ratios_; }      // 1 where blocks are single rows
  double run_correlation(std::size_t stratum) const;  // 0 for courses
  /// d of each run; 1 for courses.
  const Eigen::VectorXd& run_scatter(std::size_t stratum) const {
    return strata_[stratum].means() ? scatter_ : alike_;
  }

  /// Picks the model's runs and rotates the rotors into modes; one item per column of the result.
  Stacked stack(std::size_t stratum, const std::vector<const Components*>& items) const;

  /// Whitens with the ratio and takes out what the baseline can absorb, in place.
  void project(std::size_t stratum, std::size_t ratio, Stacked& columns) const;

  // With P the inverse covariance of independent sessions less what the baseline absorbs, Z the blocks'
  // indicators: what session variance changes products by.
  /// ZᵀV⁻¹Z at ratio 0, of which there is the diagonal alone.
  Eigen::VectorXd block_squares(std::size_t stratum) const;
  /// ZᵀPZ, blocks × blocks.
  Eigen::MatrixXd block_products(std::size_t stratum) const;
  /// (1 + a ZᵀPZ)⁻¹ times columns (a row for each block); a: the ratio. Sparse, however many blocks there
  /// are.
  Eigen::MatrixXd solve_blocks(std::size_t stratum, std::size_t ratio,
                               const Eigen::Ref<const Eigen::MatrixXd>& columns) const;

  /// Whether more than rounding is left of a column without what the baseline can absorb.
  bool sees(const Components& column) const;

  /// What the baseline, fitted to stacked columns of the model's runs, predicts for other runs (stacked
  /// likewise, not whitened). Rows whose group the model does not hold are NaN. Courses have no baseline:
  /// zero.
  Stacked baseline_prediction(std::size_t stratum, std::size_t ratio, const Stacked& columns,
                              const std::vector<int>& rows) const;

  /// Variance of that prediction's baseline part over σ², one per run (NaN likewise).
  Eigen::VectorXd baseline_variance(std::size_t stratum, std::size_t ratio,
                                    const std::vector<int>& rows) const;

  /// Draws data without any effect: session and run scatter of the given σ and ratio, and a correlation of
  /// neighbouring runs. Stacked, a column for each σ. `sizes`: of each run, over σ and its own scatter, in
  /// place of normal scatter; its sign is drawn.
  Stacked simulate(std::size_t stratum, const std::vector<double>& sigma,
                   const std::vector<std::size_t>& ratio, double run_correlation, std::mt19937_64& random,
                   const Eigen::MatrixXd& sizes = {}) const;

  /// How far each run is, over σ and its own scatter, from what the model with `columns` says of it without
  /// that run (over 1 − h); runs × modes, rms 1; of each stratum, empty of a course. Where they take up
  /// nearly all of a run, nobody else says what they do there: it is as far as from the baseline. `sigma`: of
  /// each stratum. `as_they_are`: runs that are as far as their residual.
  std::vector<Eigen::MatrixXd> sizes_left(const std::vector<std::size_t>& ratio,
                                          const std::vector<double>& sigma, const Components& y,
                                          const std::vector<Components>& columns,
                                          const Eigen::VectorXd& amplitude,
                                          const std::vector<Eigen::Index>& as_they_are) const;
  /// h of each run: the part of its whitened response that the baseline takes up; 0 of a course.
  Eigen::VectorXd baseline_leverage(std::size_t stratum, std::size_t ratio) const;
  /// `sets` of them, of unit σ and one ratio.
  Stacked simulate_unit(std::size_t stratum, std::size_t ratio, std::size_t sets, double run_correlation,
                        std::mt19937_64& random) const;

  /// By which rows of rotors are multiplied, c × c: orthonormal where rotors scatter alike. What is the same
  /// in all rotors is in the first mode alone, but for modes of rotors whose sessions differ more.
  const Eigen::MatrixXd& mode_matrix() const { return modes_; }
  /// Its inverse: by which rows of modes are multiplied.
  const Eigen::MatrixXd& rotors_of_modes() const { return rotors_of_modes_; }

 private:
  /// A constant and the slopes of one group's runs, as orthonormal columns: [1 slopes] · to_orthonormal,
  /// whose last columns are 0 where slopes are collinear with the constant.
  struct GroupBaseline {
    Eigen::Index first = 0;  // of its columns in the whole baseline
    Eigen::MatrixXd to_orthonormal;
  };
  /// L of the whole baseline in one stratum of runs' means, at one ratio.
  struct Prepared {
    /// LᵀV⁻¹L, 1 on the diagonal where a column is 0; nothing where V is 1, and so LᵀL.
    std::optional<BaselineNormal> normal;
    double log_xvx = 0;  // its log determinant, before columns were made orthonormal
  };

  MixedModel(const Observations& observations, std::vector<int> rows, const std::vector<std::size_t>& ratio,
             const RunScatter& scatter);
  void set_groups();
  /// With the root's A and w: LᵀD⁻¹AᵀAD⁻¹L, the blocks' LᵀD⁻¹Aᵀw, and wᵀw.
  NormalParts normal_parts(double run_correlation) const;
  /// At the ratios that are wanted.
  std::vector<Prepared> prepare(const NormalParts& parts, double run_correlation,
                                const std::set<std::size_t>& ratio) const;
  /// Of a stratum of runs' means: their baseline.
  const Prepared& prepared(std::size_t stratum, std::size_t ratio) const;
  std::size_t prepared_side(std::size_t stratum) const {
    return prepared_[1].empty() ? 0 : strata_[stratum].side();
  }
  double make_log_determinant(std::size_t stratum, std::size_t ratio) const;
  /// A run's few values in the columns of its group.
  Eigen::RowVectorXd baseline_row(const GroupBaseline& group, int row) const;
  /// (LᵀV⁻¹L)⁻¹ LᵀV⁻¹ columns, of whitened columns of the model's runs.
  Eigen::MatrixXd baseline_coefficients(std::size_t stratum, std::size_t ratio,
                                        Eigen::MatrixXd whitened) const;

  const Observations& observations_;
  std::vector<int> rows_;
  std::vector<std::vector<Eigen::Index>> blocks_;  // runs of each block, as positions in rows_
  std::map<int, GroupBaseline> groups_;
  Eigen::Index columns_ = 0, baseline_columns_ = 0;  // of L; those that are not 0
  double log_of_groups_ = 0;                         // Σ log|LᵀL| of the groups as they were
  /// L is sparse: of each run, the first of its columns and what stands in them.
  std::vector<Eigen::Index> first_column_;
  Eigen::MatrixXd own_;
  Eigen::MatrixXd modes_, rotors_of_modes_;
  std::vector<Stratum> strata_;
  std::size_t ratios_ = kRatios.size();
  std::array<double, 2> run_correlation_ = {0, 0};
  Eigen::VectorXd alike_, scatter_;  // 1, and d, of each run
  /// By ratio; of the rotors' differences only where their runs are correlated otherwise than the means.
  std::array<std::vector<Prepared>, 2> prepared_;
  /// Likewise: LᵀR⁻¹Z and the diagonal ZᵀR⁻¹Z, R being V at ratio 0.
  std::array<Eigen::SparseMatrix<double>, 2> with_blocks_;
  std::array<Eigen::VectorXd, 2> block_squares_;
  std::vector<std::vector<double>> log_determinant_;  // stratum, ratio
};

}  // namespace tunnelrig
