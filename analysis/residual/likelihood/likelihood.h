// Likelihood ratios of many candidates on many data sets at once: the measured one, and those simulated
// without effect.
#pragma once

#include "analysis/residual/likelihood/mixed_model.h"

#include <memory>
#include <vector>

namespace tunnelrig {

/// A candidate's columns: one for a term (its amplitude), several for a curve.
struct Candidate {
  std::vector<Components> columns;
  int sign = 0;       // of an amplitude that physics bounds to one side: +1 or −1; 0: free
  double weight = 1;  // prior weight in the maximum (Genovese, Roeder & Wasserman 2006)
};

/// How well the model without candidates fits one data set.
struct NullFit {
  std::vector<std::size_t> ratio;  // of each stratum, index in kRatios
  std::vector<double> sigma;       // run scatter of each stratum, in y; what the columns cost is allowed for
  std::vector<std::vector<double>> ratio_probability;  // likelihood of each ratio, normalised
  double log_likelihood = 0;
  /// Of each stratum, runs × modes, over σ: how far a run is drawn from its block, with either sign. None, or
  /// empty: normal scatter.
  std::vector<Eigen::MatrixXd> sizes = {};
};

/// A candidate on one data set.
struct CandidateFit {
  double likelihood_ratio = 0;  // log, ≥ 0
  double evidence = 0;          // −log10 of its own p, plus log10 of its weight: what maxima are taken of
  Eigen::VectorXd amplitude;
};

/// Statistic of all candidates with `adopted` columns already in the model, all variances fitted anew for
/// each.
class CandidateScan {
 public:
  CandidateScan(const MixedModel& model, const std::vector<Components>& adopted,
                const std::vector<Candidate>& candidates);
  ~CandidateScan();

  NullFit null_fit(const Components& y) const;
  std::vector<CandidateFit> fit(const Components& y) const;

  /// The largest evidence among the candidates in `count` data sets drawn from a fitted null model.
  std::vector<double> simulated_maxima(const NullFit& null, std::size_t count, std::mt19937_64& random) const;

  /// In as many data sets drawn likewise, of normal scatter: the amplitude (size) of each candidate's one
  /// column at which its evidence is `critical`. Data sets × candidates; nothing may be adopted.
  Eigen::MatrixXd critical_amplitudes(const NullFit& null, double critical, std::size_t count,
                                      std::mt19937_64& random) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tunnelrig
