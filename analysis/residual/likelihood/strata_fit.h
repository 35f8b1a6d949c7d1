// The model of all strata together, with and without a candidate, on one of many data sets.
#pragma once

#include "analysis/residual/likelihood/scan_products.h"

#include <utility>
#include <vector>

namespace tunnelrig {

/// Adopted columns and a candidate's together: 12 effects (--max-effects), three curves of 11 columns, and an
/// amplitude of each of 24 groups, or as many axes. Matrices on the stack make the scan half as fast again.
constexpr int kMostColumns = 96;
using SmallMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMostColumns, kMostColumns>;
using SmallVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostColumns, 1>;

/// Generalised least squares: amplitudes are the same in all strata, and each stratum has variances of its
/// own. Data sets are counted from 0, and so are candidates; candidate −1: none. Keeps addresses.
class StrataFit {
 public:
  using Data = ScanProducts::Data;

  struct State {
    std::vector<std::size_t> ratio;  // of each stratum
    std::vector<double> rss;
    SmallVector amplitude;  // adopted, then the candidate's
    double log_likelihood = 0;
  };

  StrataFit(const MixedModel& model, const ScanProducts& columns, std::vector<Eigen::Index> widths)
      : model_(model), columns_(columns), widths_(std::move(widths)), adopted_(columns.adopted()) {}

  /// At the state's session variances; σ of each stratum is found by two reweightings.
  void solve(const Data& data, Eigen::Index set, int candidate, State& state) const;

  /// Session variances one stratum after the other, each at its best with the others held.
  State best_without(const Data& data, Eigen::Index set) const;

  /// Goes to other session variances, from one to the next as long as that is likelier, where the adopted
  /// columns, or a candidate, may take a part of them away.
  void improve(const Data& data, Eigen::Index set, int candidate, State& best) const;
  static std::size_t lowest_tried(std::size_t ratio) { return ratio > 4 ? ratio - 4 : 0; }

  /// Half of what each candidate takes of the weighted sum of squares beside the adopted columns, with the
  /// variances of `held`: the first term of its log likelihood ratio, in a hundredth of the time that fitting
  /// it with its own takes (Rao 1948: the score test).
  Eigen::VectorXd scores(const Data& data, Eigen::Index set, const State& held) const;

  /// Degrees of freedom that the adopted columns take of one stratum of the first data set: its part of the
  /// trace of their hat matrix.
  double spent(const Data& data, const State& state, std::size_t stratum) const;

 private:
  /// Whether adopted columns or the candidate's are other than 0 in a stratum.
  bool concerns(int candidate, std::size_t s) const;
  /// Where there is one column and none beside it, as most are.
  void solve_alone(const Data& data, Eigen::Index set, std::size_t candidate, State& state) const;
  double weight(std::size_t s, const State& state) const;  // of a stratum's squares: 1/σ²
  static Eigen::LDLT<SmallMatrix> factored(SmallMatrix normal);
  double stratum_likelihood(std::size_t s, std::size_t ratio, double rss) const;
  /// Adds a stratum's normal equations, weighted; of the matrix what is not above the diagonal, which is all
  /// that LDLᵀ reads.
  void accumulate(const Data& data, Eigen::Index set, int candidate, std::size_t s, const State& state,
                  SmallMatrix& a, SmallVector& b) const;
  double residual(const Data& data, Eigen::Index set, int candidate, std::size_t s, const State& state) const;

  const MixedModel& model_;
  const ScanProducts& columns_;
  std::vector<Eigen::Index> widths_;  // columns of each candidate
  Eigen::Index adopted_;
};

}  // namespace tunnelrig
