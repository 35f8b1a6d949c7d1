// Generalised least squares of a baseline whose columns are many and mostly 0: a constant, and slopes, of
// each group.
#pragma once

#include <memory>
#include <vector>

#include <Eigen/Core>
#include <Eigen/SparseCore>

namespace tunnelrig {

/// What a baseline L and blocks' indicators Z are to runs of variance R: V = R + a ZZᵀ.
struct NormalParts {
  Eigen::Index columns = 0;                              // of L
  std::vector<Eigen::Triplet<double>> independent = {};  // LᵀR⁻¹L; of one place, what is added up
  std::vector<Eigen::Triplet<double>> of_blocks = {};    // LᵀR⁻¹Z, likewise
  Eigen::VectorXd blocks = {};                           // ZᵀR⁻¹Z, of which there is the diagonal alone
};

/// (LᵀV⁻¹L)⁻¹, by a sparse Cholesky factor of the mixed model equations (Henderson, Kempthorne, Searle & von
/// Krosigk, Biometrics 15, 1959), scaled so that they hold at a = 0 too:
///
///   ( LᵀR⁻¹L       √a LᵀR⁻¹Z    )
///   ( √a ZᵀR⁻¹L    1 + a ZᵀR⁻¹Z )
///
/// The blocks eliminated, LᵀV⁻¹L is left; but that is full where blocks hold many groups, and this is not.
class BaselineNormal {
 public:
  BaselineNormal(const NormalParts& parts, double session_ratio);
  BaselineNormal(BaselineNormal&&) noexcept;
  BaselineNormal& operator=(BaselineNormal&&) noexcept;
  ~BaselineNormal();

  /// (LᵀV⁻¹L)⁻¹ times right-hand sides, one row for each column of L.
  Eigen::MatrixXd solve(const Eigen::Ref<const Eigen::MatrixXd>& right) const;
  /// Columns `first` … `first + count − 1` of the inverse.
  Eigen::MatrixXd inverse_columns(Eigen::Index first, Eigen::Index count) const;
  /// (1 + a ZᵀPZ)⁻¹ times right-hand sides, one row for each block; P = R⁻¹ − R⁻¹L(LᵀR⁻¹L)⁻¹LᵀR⁻¹.
  Eigen::MatrixXd solve_blocks(const Eigen::Ref<const Eigen::MatrixXd>& right) const;
  /// log|LᵀV⁻¹L|
  double log_determinant() const { return log_determinant_; }

 private:
  Eigen::MatrixXd solve_rows(Eigen::Index first, const Eigen::Ref<const Eigen::MatrixXd>& right) const;

  struct Factor;
  std::unique_ptr<Factor> factor_;
  Eigen::Index columns_;
  double log_determinant_ = 0;
};

}  // namespace tunnelrig
