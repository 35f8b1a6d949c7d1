// Products of all columns of a scan with each other and with data sets, at every session variance: all that
// likelihoods are made of.
#pragma once

#include "analysis/residual/likelihood/likelihood.h"
#include "analysis/residual/likelihood/session_directions.h"

#include <vector>

namespace tunnelrig {

/// Adopted columns first (q), then all candidates' (K in all); projected by the model. In a model of one
/// stratum its σ is no weight, and all are what they are beside the adopted ones at once (Frisch & Waugh
/// 1933), of which none is left then (q = 0).
class ScanProducts {
 public:
  /// Of one stratum at one ratio.
  struct Products {
    Eigen::MatrixXd adopted_adopted;         // q × q
    Eigen::MatrixXd adopted_candidate;       // q × those that are kept
    std::vector<Eigen::MatrixXd> candidate;  // k × k of each
    Eigen::VectorXd squares;                 // of each candidate's columns
  };

  /// Likewise, with data sets.
  struct DataProducts {
    Eigen::VectorXd squares;  // of each data set
    Eigen::VectorXd least;    // of them that rounding may leave of a perfect fit
    Eigen::MatrixXd columns;  // those that are kept × data sets
  };
  using Data = std::vector<std::vector<DataProducts>>;  // stratum, ratio

  /// Keeps the model's address.
  ScanProducts(const MixedModel& model, const std::vector<Components>& adopted,
               const std::vector<Candidate>& candidates);

  /// With stacked data sets of each stratum, a column each.
  Data times(const std::vector<Stacked>& data) const;

  Eigen::Index adopted() const { return adopted_; }  // q
  /// Adopted columns that are no sum of others, where they were taken out.
  Eigen::Index taken_out() const { return taken_out_; }
  const Products& products(std::size_t stratum, std::size_t ratio) const { return products_[stratum][ratio]; }
  Eigen::Index first(std::size_t candidate) const { return first_[candidate]; }  // of its columns
  /// The first of its columns among those that are kept of a stratum: the adopted ones, then of candidates
  /// what is not 0 there. −1 where it is all 0, as most are: few effects change a run's course.
  Eigen::Index kept(std::size_t candidate, std::size_t stratum) const { return kept_[stratum][candidate]; }

  /// Whether a candidate, or any of the adopted columns, is other than 0 in a stratum.
  bool touches(std::size_t candidate, std::size_t stratum) const { return touches_[stratum][candidate]; }
  bool adopted_touch(std::size_t stratum) const {
    return !used_[stratum].empty() && used_[stratum][0] < adopted_;
  }

 private:
  void project(std::size_t stratum, const std::vector<const Components*>& items);
  void place(std::size_t stratum, const std::vector<Candidate>& candidates);
  std::vector<Products> multiply(std::size_t stratum, const std::vector<Candidate>& candidates) const;
  static void set_squares(Products& products);
  void multiply(std::size_t stratum, Stacked sets, Eigen::Index from,
                std::vector<DataProducts>& result) const;
  void take_out_adopted();
  void take_out_adopted(std::vector<DataProducts>& data) const;

  const MixedModel& model_;
  Eigen::Index adopted_, all_ = 0;  // q; q + K
  Eigen::Index taken_out_ = 0;
  /// Of those that were taken out, by ratio; what of each candidate's column goes with them.
  std::vector<Eigen::LDLT<Eigen::MatrixXd>> normal_of_adopted_;
  std::vector<Eigen::MatrixXd> on_adopted_;
  std::vector<Eigen::Index> first_;
  std::vector<std::vector<Eigen::Index>> used_;  // of each stratum those that are not 0 there
  std::vector<std::vector<Eigen::Index>> kept_;  // stratum, candidate
  std::vector<std::vector<Eigen::Index>> rows_;  // of each stratum's used among those that are kept
  std::vector<Eigen::Index> how_many_kept_;
  std::vector<Stacked> projected_;  // at ratio 0
  std::vector<SessionDirections> sessions_;
  std::vector<Stacked> by_session_;              // the projected columns' coordinates in them
  std::vector<std::vector<Products>> products_;  // stratum, ratio
  std::vector<std::vector<bool>> touches_;       // stratum, candidate
};

}  // namespace tunnelrig
