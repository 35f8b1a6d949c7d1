#include "analysis/residual/likelihood.h"

#include "analysis/residual/evidence_table.h"
#include "analysis/residual/in_two_threads.h"
#include "analysis/residual/scan_products.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <stdexcept>

#include <fmt/format.h>

namespace tunnelrig {
namespace {

using Eigen::Index;

/// Adopted columns and a candidate's together: 12 effects (--max-effects), three curves of 11 columns, and an
/// amplitude of each of 24 groups, or as many axes. Matrices on the stack make the scan half as fast again.
constexpr int kMostColumns = 96;
using SmallMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMostColumns, kMostColumns>;
using SmallVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostColumns, 1>;

using Data = ScanProducts::Data;

}  // namespace

struct CandidateScan::Impl {
  const MixedModel& model;
  std::vector<Candidate> candidates;
  const ScanProducts columns;
  const Index adopted, all_adopted;  // beside the candidates; with those that were taken out of all
  std::map<std::pair<int, Index>, EvidenceTable> tables;
  std::vector<const EvidenceTable*> table_of;

  Impl(const MixedModel& m, const std::vector<Components>& adopted_columns, const std::vector<Candidate>& all)
      : model(m),
        candidates(all),
        columns(m, adopted_columns, candidates),
        adopted(columns.adopted()),
        all_adopted(static_cast<Index>(adopted_columns.size())) {
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      if (all_adopted + static_cast<Index>(candidates[i].columns.size()) > kMostColumns)
        throw std::length_error(fmt::format("a model of more than {} columns", kMostColumns));
      table_of.push_back(table_for(i));
    }
  }

  const EvidenceTable* table_for(std::size_t i) {
    Index observations = 0;
    for (std::size_t s = 0; s < model.strata().size(); ++s)
      if (columns.touches(i, s)) observations += model.dof(s);
    const int own = static_cast<int>(candidates[i].columns.size());
    observations = std::max<Index>(observations - all_adopted, own + 2);
    return &tables.try_emplace({own, observations}, own, static_cast<double>(observations)).first->second;
  }

  Data times(const Components& y) const {
    std::vector<Stacked> data;
    for (std::size_t s = 0; s < model.strata().size(); ++s) data.push_back(model.stack(s, {&y}));
    return columns.times(data);
  }

  /// `sizes`: of the runs, as NullFit has them.
  std::vector<Stacked> simulated(const NullFit& null, std::size_t count,
                                 const std::vector<Eigen::MatrixXd>& sizes, std::mt19937_64& random) const {
    std::vector<Stacked> data;
    for (std::size_t s = 0; s < model.strata().size(); ++s) {
      // The session variance is not known better than its likelihood says: each data set draws its own.
      std::discrete_distribution<std::size_t> draw(null.ratio_probability[s].begin(),
                                                   null.ratio_probability[s].end());
      std::vector<std::size_t> ratio(count);
      for (std::size_t& r : ratio) r = draw(random);
      data.push_back(model.simulate(s, std::vector<double>(count, null.sigma[s]), ratio,
                                    model.run_correlation(s), random,
                                    sizes.empty() ? Eigen::MatrixXd() : sizes[s]));
    }
    return data;
  }

  struct State {
    std::vector<std::size_t> ratio;  // of each stratum
    std::vector<double> rss;
    SmallVector amplitude;  // adopted, then the candidate's
    double log_likelihood = 0;
  };

  /// Whether adopted columns or the candidate's are other than 0 in a stratum.
  bool concerns(int candidate, std::size_t s) const {
    return columns.adopted_touch(s) ||
           (candidate >= 0 && columns.touches(static_cast<std::size_t>(candidate), s));
  }

  /// Generalised least squares of all strata together, their variances found by two reweightings; candidate
  /// −1: none.
  void solve(const Data& data, Index set, int candidate, State& state) const {
    const Index own =
        candidate < 0 ? 0
                      : static_cast<Index>(candidates[static_cast<std::size_t>(candidate)].columns.size());
    const Index k = adopted + own;
    const std::size_t strata = model.strata().size();
    state.rss.resize(strata);
    for (std::size_t s = 0; s < strata; ++s) state.rss[s] = data[s][state.ratio[s]].squares(set);
    if (k == 1 && own == 1) {
      solve_alone(data, set, static_cast<std::size_t>(candidate), state);
    } else if (k > 0) {
      for (int pass = 0; pass < 2; ++pass) {
        SmallMatrix a = SmallMatrix::Zero(k, k);
        SmallVector b = SmallVector::Zero(k);
        for (std::size_t s = 0; s < strata; ++s)
          if (concerns(candidate, s)) accumulate(data, set, candidate, s, state, a, b);
        a.diagonal().array() *= 1 + 1e-12;
        a.diagonal().array() += 1e-300;
        state.amplitude = a.ldlt().solve(b);
        for (std::size_t s = 0; s < strata; ++s)
          if (concerns(candidate, s)) state.rss[s] = residual(data, set, candidate, s, state);
      }
    }
    state.log_likelihood = 0;
    for (std::size_t s = 0; s < strata; ++s)
      state.log_likelihood += stratum_likelihood(s, state.ratio[s], state.rss[s]);
  }

  /// The same of one column and none beside it, as most are.
  void solve_alone(const Data& data, Index set, std::size_t candidate, State& state) const {
    const Index column = columns.first(candidate);
    for (int pass = 0; pass < 2; ++pass) {
      double a = 1e-300, b = 0;
      for (std::size_t s = 0; s < model.strata().size(); ++s) {
        if (!columns.touches(candidate, s)) continue;
        const std::size_t ratio = state.ratio[s];
        const double weight = static_cast<double>(model.dof(s)) / std::max(state.rss[s], 1e-300);
        a += weight * columns.products(s, ratio).candidate[candidate](0, 0);
        b += weight * data[s][ratio].columns(column, set);
      }
      const double amplitude = b / a;
      state.amplitude = SmallVector::Constant(1, amplitude);
      for (std::size_t s = 0; s < model.strata().size(); ++s) {
        if (!columns.touches(candidate, s)) continue;
        const std::size_t ratio = state.ratio[s];
        const double own = columns.products(s, ratio).candidate[candidate](0, 0);
        const double squares = data[s][ratio].squares(set), with = data[s][ratio].columns(column, set);
        state.rss[s] =
            std::max(squares - amplitude * (2 * with - amplitude * own), data[s][ratio].least(set));
      }
    }
  }

  double stratum_likelihood(std::size_t s, std::size_t ratio, double rss) const {
    const double dof = static_cast<double>(model.dof(s));
    return -0.5 * dof * std::log(std::max(rss, 1e-300) / dof) - model.log_determinant(s, ratio);
  }

  template <class A, class B>
  void normal_equations(const Data& data, Index set, int candidate, std::size_t s, const State& state, A& a,
                        B& b) const {
    const ScanProducts::Products& p = columns.products(s, state.ratio[s]);
    const auto& y = data[s][state.ratio[s]].columns;
    a.topLeftCorner(adopted, adopted) = p.adopted_adopted;
    b.head(adopted) = y.col(set).head(adopted);
    if (candidate < 0) return;
    const auto i = static_cast<std::size_t>(candidate);
    const Index own = a.rows() - adopted;
    a.topRightCorner(adopted, own) = p.adopted_candidate.middleCols(columns.first(i), own);
    a.bottomLeftCorner(own, adopted) = a.topRightCorner(adopted, own).transpose();
    a.bottomRightCorner(own, own) = p.candidate[i];
    b.tail(own) = y.col(set).segment(columns.first(i), own);
  }

  void accumulate(const Data& data, Index set, int candidate, std::size_t s, const State& state,
                  SmallMatrix& a, SmallVector& b) const {
    SmallMatrix stratum_a(a.rows(), a.cols());
    SmallVector stratum_b(b.size());
    normal_equations(data, set, candidate, s, state, stratum_a, stratum_b);
    const double weight = static_cast<double>(model.dof(s)) / std::max(state.rss[s], 1e-300);
    a += weight * stratum_a;
    b += weight * stratum_b;
  }

  /// Degrees of freedom that the adopted columns take of one stratum: its part of the trace of their hat
  /// matrix.
  double spent(const Data& data, const State& state, std::size_t stratum) const {
    if (adopted == 0) return static_cast<double>(columns.taken_out());
    SmallMatrix all = SmallMatrix::Zero(adopted, adopted), own = all;
    SmallVector unused = SmallVector::Zero(adopted);
    for (std::size_t s = 0; s < model.strata().size(); ++s) {
      accumulate(data, 0, -1, s, state, all, unused);
      if (s == stratum) accumulate(data, 0, -1, s, state, own, unused);
    }
    const Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> solver(all);
    return solver.solve(Eigen::MatrixXd(own)).trace();
  }

  double residual(const Data& data, Index set, int candidate, std::size_t s, const State& state) const {
    SmallMatrix a(state.amplitude.size(), state.amplitude.size());
    SmallVector b(state.amplitude.size());
    normal_equations(data, set, candidate, s, state, a, b);
    const ScanProducts::DataProducts& y = data[s][state.ratio[s]];
    return std::max(y.squares(set) - 2 * state.amplitude.dot(b) + state.amplitude.dot(a * state.amplitude),
                    y.least(set));
  }

  /// Ratios one stratum after the other, each at its best with the others held.
  State best_without(const Data& data, Index set) const {
    State best{.ratio = std::vector<std::size_t>(model.strata().size(), 0), .rss = {}, .amplitude = {}};
    for (std::size_t s = 0; s < best.ratio.size(); ++s) {
      double highest = -std::numeric_limits<double>::infinity();
      for (std::size_t ratio = 0; ratio < model.ratios(); ++ratio) {
        const double value = stratum_likelihood(s, ratio, data[s][ratio].squares(set));
        if (value > highest) {
          highest = value;
          best.ratio[s] = ratio;
        }
      }
    }
    solve(data, set, -1, best);
    if (adopted > 0) improve(data, set, -1, best);
    return best;
  }

  /// Tries other session variances for the runs' means, where a candidate may take a part of them away.
  void improve(const Data& data, Index set, int candidate, State& best) const {
    for (std::size_t s = 0; s < model.strata().size(); ++s) {
      if (!model.strata()[s].means()) continue;
      if (candidate >= 0 && !columns.touches(static_cast<std::size_t>(candidate), s)) continue;
      const std::size_t start = best.ratio[s];
      const std::size_t end = candidate < 0 ? model.ratios() : start;
      for (std::size_t ratio = candidate < 0 ? 0 : start > 4 ? start - 4 : 0; ratio < end; ++ratio) {
        State tried = best;
        tried.ratio[s] = ratio;
        solve(data, set, candidate, tried);
        if (tried.log_likelihood > best.log_likelihood) best = std::move(tried);
      }
    }
  }

  /// By how much a candidate's evidence may grow with a smaller session variance, which has a part of the
  /// candidate's work in it: of sessions that scatter little, hardly at all.
  double most_hidden(std::size_t candidate, const State& null) const {
    constexpr std::array<double, kRatios.size()> kMostHidden = {0, 0, 0, 0, 0, 1.5, 3, 6, 1e9};
    double most = 0;
    for (std::size_t s = 0; s < model.strata().size(); ++s)
      if (model.strata()[s].means() && columns.touches(candidate, s))
        most = std::max(most, kMostHidden[null.ratio[s]]);
    return most;
  }

  CandidateFit fit_candidate(const Data& data, Index set, int candidate, const State& null,
                             double threshold) const {
    const auto i = static_cast<std::size_t>(candidate);
    CandidateFit result;
    State state = null;
    solve(data, set, candidate, state);
    const Index own = static_cast<Index>(candidates[i].columns.size());
    const auto evidence = [&](const State& s) {
      const double ratio = std::max(0.0, s.log_likelihood - null.log_likelihood);
      const bool wrong_side = own == 1 && candidates[i].sign * s.amplitude(adopted) < 0;
      return wrong_side ? 0.0 : (*table_of[i])(ratio) + std::log10(candidates[i].weight);
    };
    // A smaller session variance can only help a candidate that varies between sessions, and rarely by much
    // unless it is large itself: it is tried where it may decide.
    if (evidence(state) > threshold - most_hidden(i, null)) improve(data, set, candidate, state);
    result.likelihood_ratio = std::max(0.0, state.log_likelihood - null.log_likelihood);
    result.evidence = evidence(state);
    result.amplitude = state.amplitude.tail(own);
    return result;
  }

  /// One data set with so much of a candidate's column added to it.
  Data planted(const Data& data, Index set, std::size_t candidate, double amplitude) const {
    const Index column = columns.first(candidate);
    Data result(data.size());
    for (std::size_t s = 0; s < data.size(); ++s)
      for (std::size_t ratio = 0; ratio < data[s].size(); ++ratio) {
        const double own =
            columns.touches(candidate, s) ? columns.products(s, ratio).candidate[candidate](0, 0) : 0;
        const double with = data[s][ratio].columns(column, set);
        const ScanProducts::DataProducts& y = data[s][ratio];
        result[s].push_back({y.squares.segment(set, 1), y.least.segment(set, 1), y.columns.col(set)});
        result[s][ratio].squares(0) += amplitude * (2 * with + amplitude * own);
        result[s][ratio].columns(column, 0) += amplitude * own;
      }
    return result;
  }

  /// By bisection between powers of two of the column's standard error; infinite where it is never reached.
  double critical_amplitude(const Data& data, Index set, std::size_t candidate, double critical) const {
    constexpr int kBisections = 7, kDoublings = 8;
    const double sign = candidates[candidate].sign < 0 ? -1 : 1;
    const auto reaches = [&](double amplitude) {
      const Data with = planted(data, set, candidate, sign * amplitude);
      return fit_candidate(with, 0, static_cast<int>(candidate), best_without(with, 0), critical).evidence >=
             critical;
    };
    double high = standard_error(data, set, candidate);
    int doublings = 0;
    while (!reaches(high) && ++doublings <= kDoublings) high *= 2;
    if (doublings > kDoublings) return std::numeric_limits<double>::infinity();
    double low = doublings > 0 ? high / 2 : 0;
    for (int step = 0; step < kBisections; ++step) {
      const double middle = (low + high) / 2;
      (reaches(middle) ? high : low) = middle;
    }
    return high;
  }

  /// Where runs are independent.
  double standard_error(const Data& data, Index set, std::size_t candidate) const {
    double information = 1e-300;
    for (std::size_t s = 0; s < data.size(); ++s)
      if (columns.touches(candidate, s))
        information += columns.products(s, 0).candidate[candidate](0, 0) * static_cast<double>(model.dof(s)) /
                       std::max(data[s][0].squares(set), 1e-300);
    return 1 / std::sqrt(information);
  }
};

CandidateScan::CandidateScan(const MixedModel& model, const std::vector<Components>& adopted,
                             const std::vector<Candidate>& candidates)
    : impl_(std::make_unique<Impl>(model, adopted, candidates)) {}
CandidateScan::~CandidateScan() = default;

NullFit CandidateScan::null_fit(const Components& y) const {
  const Data products = impl_->times(y);
  const Impl::State state = impl_->best_without(products, 0);
  NullFit result{
      .ratio = state.ratio, .sigma = {}, .ratio_probability = {}, .log_likelihood = state.log_likelihood};
  for (std::size_t s = 0; s < state.ratio.size(); ++s) {
    const double dof = static_cast<double>(impl_->model.dof(s)) - impl_->spent(products, state, s);
    result.sigma.push_back(std::sqrt(state.rss[s] / std::max(dof, 1.0)));
    std::vector<double> probability;
    for (std::size_t ratio = 0; ratio < impl_->model.ratios(); ++ratio) {
      Impl::State other = state;
      other.ratio[s] = ratio;
      impl_->solve(products, 0, -1, other);
      probability.push_back(std::exp(std::min(0.0, other.log_likelihood - state.log_likelihood)));
    }
    double sum = 0;
    for (const double p : probability) sum += p;
    for (double& p : probability) p /= sum;
    result.ratio_probability.push_back(std::move(probability));
  }
  return result;
}

std::vector<CandidateFit> CandidateScan::fit(const Components& y) const {
  const Data products = impl_->times(y);
  const Impl::State null = impl_->best_without(products, 0);
  std::vector<CandidateFit> result;
  for (std::size_t i = 0; i < impl_->candidates.size(); ++i)
    result.push_back(impl_->fit_candidate(products, 0, static_cast<int>(i), null, 0));
  return result;
}

std::vector<double> CandidateScan::simulated_maxima(const NullFit& null, std::size_t count,
                                                    std::mt19937_64& random) const {
  const Data products = impl_->columns.times(impl_->simulated(null, count, null.sizes, random));
  std::vector<double> maxima(count, 0.0);
  in_two_threads(count, [&](std::size_t set) {
    const Impl::State state = impl_->best_without(products, static_cast<Index>(set));
    for (std::size_t i = 0; i < impl_->candidates.size(); ++i) {
      // Within a factor of a hundred of the largest so far, a better variance may still make it the largest.
      const double threshold = std::max(0.5, maxima[set] - 2);
      maxima[set] = std::max(
          maxima[set],
          impl_->fit_candidate(products, static_cast<Index>(set), static_cast<int>(i), state, threshold)
              .evidence);
    }
  });
  return maxima;
}

Eigen::MatrixXd CandidateScan::critical_amplitudes(const NullFit& null, double critical, std::size_t count,
                                                   std::mt19937_64& random) const {
  const Data products = impl_->columns.times(impl_->simulated(null, count, {}, random));
  Eigen::MatrixXd result(count, impl_->candidates.size());
  in_two_threads(count, [&](std::size_t set) {
    for (std::size_t i = 0; i < impl_->candidates.size(); ++i)
      result(static_cast<Index>(set), static_cast<Index>(i)) =
          impl_->critical_amplitude(products, static_cast<Index>(set), i, critical);
  });
  return result;
}

}  // namespace tunnelrig
