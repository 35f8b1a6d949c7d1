#include "analysis/residual/likelihood.h"

#include "analysis/residual/evidence_table.h"
#include "analysis/residual/session_directions.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <thread>

namespace tunnelrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/// Adopted columns and a candidate's together.
constexpr int kMostColumns = 24;
using SmallMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMostColumns, kMostColumns>;
using SmallVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostColumns, 1>;

/// Every other one of `count` independent jobs in a thread of its own.
template <class Job>
void in_two_threads(std::size_t count, const Job& job) {
  const auto work = [&](std::size_t k) {
    for (; k < count; k += 2) job(k);
  };
  std::thread second(work, 1);
  work(0);
  second.join();
}

/// One stratum at one ratio: products of all columns with each other.
struct Products {
  MatrixXd adopted_adopted;         // q × q
  MatrixXd adopted_candidate;       // q × K
  std::vector<MatrixXd> candidate;  // k × k of each
};

/// Products with data sets.
struct DataProducts {
  Eigen::VectorXd squares;  // of each data set
  MatrixXd columns;         // (q + K) × data sets
};

}  // namespace

struct CandidateScan::Impl {
  const MixedModel& model;
  Index adopted = 0;
  std::vector<Candidate> candidates;
  std::vector<Index> first;  // column of each candidate
  Index all_columns = 0;     // adopted first, then all candidates'
  /// Of each stratum, projected at ratio 0, those that are not 0 there, and which they are: few effects
  /// change a run's course.
  std::vector<Stacked> projected;
  std::vector<std::vector<Index>> used;
  std::vector<SessionDirections> sessions;  // of each stratum, and the columns' coordinates in them
  std::vector<Stacked> by_session;
  std::vector<std::vector<Products>> products;  // stratum, ratio
  std::map<std::pair<int, Index>, EvidenceTable> tables;
  std::vector<const EvidenceTable*> table_of;
  std::vector<std::vector<bool>> touches;  // candidate, stratum

  Impl(const MixedModel& m, const std::vector<Components>& adopted_columns, const std::vector<Candidate>& all)
      : model(m), adopted(static_cast<Index>(adopted_columns.size())), candidates(all) {
    std::vector<const Components*> items;
    for (const Components& column : adopted_columns) items.push_back(&column);
    for (const Candidate& candidate : candidates) {
      first.push_back(static_cast<Index>(items.size()));
      for (const Components& column : candidate.columns) items.push_back(&column);
    }
    all_columns = static_cast<Index>(items.size());
    touches.assign(candidates.size(), std::vector<bool>(model.strata().size(), false));
    for (std::size_t s = 0; s < model.strata().size(); ++s) {
      project_used(s, items);
      sessions.emplace_back(model, s);
      by_session.push_back(sessions[s].coordinates(projected[s]));
    }
    products.resize(model.strata().size());
    in_two_threads(model.strata().size(), [&](std::size_t s) { products[s] = multiply(s); });
    for (std::size_t s = 0; s < model.strata().size(); ++s) mark_touched(s);
    for (std::size_t i = 0; i < candidates.size(); ++i) table_of.push_back(table_for(i));
  }

  void project_used(std::size_t s, const std::vector<const Components*>& items) {
    constexpr double kNothing =
        1e-14;  // of a column's squares: what is left of what the baseline has is rounding
    std::vector<const Components*> of_stratum;
    std::vector<Index> columns;
    for (std::size_t i = 0; i < items.size(); ++i)
      if (!(*items[i])[model.strata()[s].component].isZero(0)) {
        columns.push_back(static_cast<Index>(i));
        of_stratum.push_back(items[i]);
      }
    const Stacked stacked = model.stack(s, of_stratum);
    Stacked left = stacked;
    model.project(s, 0, left);
    std::vector<Index> kept;
    used.emplace_back();
    for (Index c = 0; c < left.cols(); ++c)
      if (left.col(c).squaredNorm() > kNothing * stacked.col(c).squaredNorm()) {
        kept.push_back(c);
        used[s].push_back(columns[static_cast<std::size_t>(c)]);
      }
    projected.emplace_back(left(Eigen::all, kept));
  }

  std::vector<Products> multiply(std::size_t s) const {
    const auto all = [&](const Stacked& of_used) {
      Stacked result = Stacked::Zero(of_used.rows(), all_columns);
      result(Eigen::all, used[s]) = of_used;
      return result;
    };
    const Stacked c = all(projected[s]), in_sessions = all(by_session[s]);
    std::vector<Products> result(model.ratios());
    for (std::size_t ratio = 0; ratio < model.ratios(); ++ratio) {
      const Eigen::VectorXd weights = sessions[s].weights(kRatios[ratio]);
      const auto product = [&](Index first_a, Index a, Index first_b, Index b) -> MatrixXd {
        return c.middleCols(first_a, a).transpose() * c.middleCols(first_b, b) -
               in_sessions.middleCols(first_a, a).transpose() * weights.asDiagonal() *
                   in_sessions.middleCols(first_b, b);
      };
      result[ratio].adopted_adopted = product(0, adopted, 0, adopted);
      result[ratio].adopted_candidate = product(0, adopted, 0, all_columns);
      for (std::size_t i = 0; i < candidates.size(); ++i) {
        const auto own = static_cast<Index>(candidates[i].columns.size());
        result[ratio].candidate.push_back(product(first[i], own, first[i], own));
      }
    }
    return result;
  }

  void mark_touched(std::size_t s) {
    for (std::size_t i = 0; i < candidates.size(); ++i)
      touches[i][s] = products[s][0].candidate[i].trace() > 0;
  }

  const EvidenceTable* table_for(std::size_t i) {
    Index observations = 0;
    for (std::size_t s = 0; s < model.strata().size(); ++s)
      if (touches[i][s]) observations += model.dof(s);
    const int columns = static_cast<int>(candidates[i].columns.size());
    observations = std::max<Index>(observations - adopted, columns + 2);
    return &tables.try_emplace({columns, observations}, columns, static_cast<double>(observations))
                .first->second;
  }

  // --- data
  // ---------------------------------------------------------------------------------------------------------

  using Data = std::vector<std::vector<DataProducts>>;  // stratum, ratio

  Data multiply_data(std::vector<Stacked> data) const {
    Data result(data.size(), std::vector<DataProducts>(model.ratios()));
    for (std::size_t s = 0; s < data.size(); ++s)
      for (DataProducts& products_of : result[s]) {
        products_of.squares.resize(data[s].cols());
        products_of.columns = MatrixXd::Zero(all_columns, data[s].cols());
      }
    in_two_threads(2 * data.size(), [&](std::size_t k) {  // half of the data sets of a stratum
      const std::size_t s = k / 2;
      const Index half = data[s].cols() / 2, from = k % 2 == 0 ? 0 : half;
      multiply_data(s, data[s].middleCols(from, k % 2 == 0 ? half : data[s].cols() - half), from, result[s]);
    });
    return result;
  }

  void multiply_data(std::size_t s, Stacked sets, Index from, std::vector<DataProducts>& result) const {
    model.project(s, 0, sets);
    const Stacked in_sessions = sessions[s].coordinates(sets);
    const Eigen::VectorXd squares = sets.colwise().squaredNorm();
    const MatrixXd columns = projected[s].transpose() * sets;
    for (std::size_t ratio = 0; ratio < model.ratios(); ++ratio) {
      const Stacked weighted = sessions[s].weights(kRatios[ratio]).asDiagonal() * in_sessions;
      result[ratio].squares.segment(from, sets.cols()) =
          squares - weighted.cwiseProduct(in_sessions).colwise().sum().transpose();
      result[ratio].columns(used[s], Eigen::seqN(from, sets.cols())) =
          columns - by_session[s].transpose() * weighted;
    }
  }

  // --- one data set
  // -------------------------------------------------------------------------------------------------

  struct State {
    std::vector<std::size_t> ratio;  // of each stratum
    std::vector<double> rss;
    SmallVector amplitude;  // adopted, then the candidate's
    double log_likelihood = 0;
  };

  /// Whether adopted columns or the candidate's are other than 0 in a stratum.
  bool concerns(int candidate, std::size_t s) const {
    return (!used[s].empty() && used[s][0] < adopted) ||
           (candidate >= 0 && touches[static_cast<std::size_t>(candidate)][s]);
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
    if (k > 0) {
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

  double stratum_likelihood(std::size_t s, std::size_t ratio, double rss) const {
    const double dof = static_cast<double>(model.dof(s));
    return -0.5 * dof * std::log(std::max(rss, 1e-300) / dof) - model.log_determinant(s, ratio);
  }

  template <class A, class B>
  void normal_equations(const Data& data, Index set, int candidate, std::size_t s, const State& state, A& a,
                        B& b) const {
    const Products& p = products[s][state.ratio[s]];
    const auto& y = data[s][state.ratio[s]].columns;
    a.topLeftCorner(adopted, adopted) = p.adopted_adopted;
    b.head(adopted) = y.col(set).head(adopted);
    if (candidate < 0) return;
    const auto i = static_cast<std::size_t>(candidate);
    const Index own = a.rows() - adopted;
    a.topRightCorner(adopted, own) = p.adopted_candidate.middleCols(first[i], own);
    a.bottomLeftCorner(own, adopted) = a.topRightCorner(adopted, own).transpose();
    a.bottomRightCorner(own, own) = p.candidate[i];
    b.tail(own) = y.col(set).segment(first[i], own);
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
    if (adopted == 0) return 0;
    SmallMatrix all = SmallMatrix::Zero(adopted, adopted), own = all;
    SmallVector unused = SmallVector::Zero(adopted);
    for (std::size_t s = 0; s < model.strata().size(); ++s) {
      accumulate(data, 0, -1, s, state, all, unused);
      if (s == stratum) accumulate(data, 0, -1, s, state, own, unused);
    }
    const Eigen::CompleteOrthogonalDecomposition<MatrixXd> solver(all);
    return solver.solve(MatrixXd(own)).trace();
  }

  double residual(const Data& data, Index set, int candidate, std::size_t s, const State& state) const {
    SmallMatrix a(state.amplitude.size(), state.amplitude.size());
    SmallVector b(state.amplitude.size());
    normal_equations(data, set, candidate, s, state, a, b);
    const double squares = data[s][state.ratio[s]].squares(set);
    return std::max(squares - 2 * state.amplitude.dot(b) + state.amplitude.dot(a * state.amplitude),
                    1e-12 * squares);
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
      if (candidate >= 0 && !touches[static_cast<std::size_t>(candidate)][s]) continue;
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
      if (model.strata()[s].means() && touches[candidate][s])
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
};

CandidateScan::CandidateScan(const MixedModel& model, const std::vector<Components>& adopted,
                             const std::vector<Candidate>& candidates)
    : impl_(std::make_unique<Impl>(model, adopted, candidates)) {}
CandidateScan::~CandidateScan() = default;

NullFit CandidateScan::null_fit(const Components& y) const {
  std::vector<Stacked> data;
  for (std::size_t s = 0; s < impl_->model.strata().size(); ++s) data.push_back(impl_->model.stack(s, {&y}));
  const Impl::Data products = impl_->multiply_data(std::move(data));
  const Impl::State state = impl_->best_without(products, 0);
  NullFit result{
      .ratio = state.ratio, .sigma = {}, .ratio_probability = {}, .log_likelihood = state.log_likelihood};
  for (std::size_t s = 0; s < impl_->model.strata().size(); ++s) {
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
  std::vector<Stacked> data;
  for (std::size_t s = 0; s < impl_->model.strata().size(); ++s) data.push_back(impl_->model.stack(s, {&y}));
  const Impl::Data products = impl_->multiply_data(std::move(data));
  const Impl::State null = impl_->best_without(products, 0);
  std::vector<CandidateFit> result;
  for (std::size_t i = 0; i < impl_->candidates.size(); ++i)
    result.push_back(impl_->fit_candidate(products, 0, static_cast<int>(i), null, 0));
  return result;
}

std::vector<double> CandidateScan::simulated_maxima(const NullFit& null, std::size_t count,
                                                    std::mt19937_64& random) const {
  std::vector<Stacked> data;
  for (std::size_t s = 0; s < impl_->model.strata().size(); ++s) {
    // The session variance is not known better than its likelihood says: each data set draws its own.
    std::discrete_distribution<std::size_t> draw(null.ratio_probability[s].begin(),
                                                 null.ratio_probability[s].end());
    std::vector<std::size_t> ratio(count);
    for (std::size_t& r : ratio) r = draw(random);
    data.push_back(impl_->model.simulate(s, std::vector<double>(count, null.sigma[s]), ratio,
                                         impl_->model.run_correlation(s), random,
                                         null.sizes.empty() ? Eigen::MatrixXd() : null.sizes[s]));
  }
  const Impl::Data products = impl_->multiply_data(std::move(data));
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

}  // namespace tunnelrig
