#include "analysis/residual/likelihood/likelihood.h"

#include "analysis/residual/likelihood/evidence_table.h"
#include "analysis/residual/likelihood/in_two_threads.h"
#include "analysis/residual/likelihood/scan_products.h"
#include "analysis/residual/likelihood/strata_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <stdexcept>

#include <fmt/format.h>

namespace tunnelrig {

using Eigen::Index;

struct CandidateScan::Impl {
  using Data = ScanProducts::Data;
  using State = StrataFit::State;

  const MixedModel& model;
  struct Prior {
    int sign;
    double weight;
  };
  const std::vector<Prior> candidates;  // whose columns, of many runs, are kept once: in `columns`
  const std::vector<Index> widths;      // columns of each
  const ScanProducts columns;
  const Index adopted, all_adopted;  // beside the candidates; with those that were taken out of all
  const StrataFit strata;
  std::map<std::pair<int, Index>, EvidenceTable> tables;
  std::vector<const EvidenceTable*> table_of;

  Impl(const MixedModel& m, const std::vector<Components>& adopted_columns, const std::vector<Candidate>& all)
      : model(m),
        candidates(priors_of(all)),
        widths(widths_of(all)),
        columns(m, adopted_columns, all),
        adopted(columns.adopted()),
        all_adopted(static_cast<Index>(adopted_columns.size())),
        strata(m, columns, widths) {
    check_width(0);
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      check_width(widths[i]);
      table_of.push_back(table_for(i));
    }
  }

  void check_width(Index beside_adopted) const {
    if (all_adopted + beside_adopted > kMostColumns)
      throw std::length_error(fmt::format("a model of more than {} columns", kMostColumns));
  }

  static std::vector<Prior> priors_of(const std::vector<Candidate>& all) {
    std::vector<Prior> result;
    for (const Candidate& each : all) result.push_back({each.sign, each.weight});
    return result;
  }

  static std::vector<Index> widths_of(const std::vector<Candidate>& all) {
    std::vector<Index> result;
    for (const Candidate& each : all) result.push_back(std::ssize(each.columns));
    return result;
  }

  const EvidenceTable* table_for(std::size_t i) {
    Index observations = 0;
    for (std::size_t s = 0; s < model.strata().size(); ++s)
      if (columns.touches(i, s)) observations += model.dof(s);
    const int own = static_cast<int>(widths[i]);
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

  /// By how much a candidate's evidence may grow with a smaller session variance, which has a part of the
  /// candidate's work in it: of sessions that scatter little, hardly at all. By that variance.
  static constexpr std::array<double, kRatios.size()> kMostHidden = {0, 0, 0, 0, 0, 1.5, 3, 6, 1e9};

  double most_hidden(std::size_t candidate, const State& null) const {
    double most = 0;
    for (std::size_t s = 0; s < model.strata().size(); ++s)
      if (columns.touches(candidate, s)) most = std::max(most, kMostHidden[null.ratio[s]]);
    return most;
  }

  CandidateFit fit_candidate(const Data& data, Index set, int candidate, const State& null,
                             double threshold) const {
    const auto i = static_cast<std::size_t>(candidate);
    CandidateFit result;
    State state = null;
    strata.solve(data, set, candidate, state);
    const Index own = widths[i];
    const auto evidence = [&](const State& s) {
      const double ratio = std::max(0.0, s.log_likelihood - null.log_likelihood);
      const bool wrong_side = own == 1 && candidates[i].sign * s.amplitude(adopted) < 0;
      return wrong_side ? 0.0 : (*table_of[i])(ratio) + std::log10(candidates[i].weight);
    };
    // A smaller session variance can only help a candidate that varies between sessions, and rarely by much
    // unless it is large itself: it is tried where it may decide.
    if (evidence(state) > threshold - most_hidden(i, null)) strata.improve(data, set, candidate, state);
    result.likelihood_ratio = std::max(0.0, state.log_likelihood - null.log_likelihood);
    result.evidence = evidence(state);
    result.amplitude = state.amplitude.tail(own);
    return result;
  }

  /// Of each candidate no less than what fit_candidate gives, but for a few tenths in one data set of a
  /// hundred.
  Eigen::VectorXd most_evidence(const Data& data, Index set, const State& null) const {
    constexpr double kFactor = 1.3, kMargin = 1.5;  // its variances are smaller with it
    const auto ratios_at = [&](const State& state) -> Eigen::VectorXd {
      return strata.scores(data, set, state).array() + (state.log_likelihood - null.log_likelihood);
    };
    const Eigen::VectorXd held = ratios_at(null);
    Eigen::VectorXd result = held;
    for (std::size_t s = 0; s < model.strata().size(); ++s) {
      if (kMostHidden[null.ratio[s]] == 0) continue;
      Eigen::VectorXd best = held;
      for (std::size_t ratio = StrataFit::lowest_tried(null.ratio[s]); ratio < null.ratio[s]; ++ratio) {
        State other = null;
        other.ratio[s] = ratio;
        strata.solve(data, set, -1, other);
        best = best.cwiseMax(ratios_at(other));
      }
      result += best - held;
    }
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      double& of_this = result(static_cast<Index>(i));
      // Of a column that is a sum of the adopted ones it may be anything, and takes nothing away.
      if (!std::isfinite(of_this) || of_this < 0) of_this = 0;
      of_this = (*table_of[i])(kFactor * of_this + kMargin) + std::log10(candidates[i].weight);
    }
    return result;
  }

  /// As many data sets as fit into 300 MB: of ten thousands of runs not all.
  std::size_t sets_at_once(std::size_t count) const {
    constexpr std::size_t kNumbers = 40'000'000, kFewest = 10;
    std::size_t numbers = 0;  // of a data set
    for (const MixedModel::Stratum& stratum : model.strata())
      numbers += model.rows().size() * static_cast<std::size_t>(stratum.modes);
    return std::min(count, std::max(kFewest, kNumbers / std::max<std::size_t>(numbers, 1)));
  }

  /// Of each data set the largest evidence among the candidates.
  std::vector<double> maxima_of(const Data& sets) const {
    const auto count = static_cast<std::size_t>(sets[0][0].squares.size());
    std::vector<double> maxima(count, 0.0);
    in_two_threads(count, [&](std::size_t set) {
      const State state = strata.best_without(sets, static_cast<Index>(set));
      const Eigen::VectorXd most = most_evidence(sets, static_cast<Index>(set), state);
      std::vector<std::size_t> order(candidates.size());
      std::iota(order.begin(), order.end(), 0U);
      const auto of = [&](std::size_t i) { return most(static_cast<Index>(i)); };
      std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return of(a) > of(b); });
      for (const std::size_t i : order) {
        if (of(i) <= maxima[set]) break;
        // Within a factor of a hundred of the largest so far, a better variance may still make it the
        // largest.
        const double threshold = std::max(0.5, maxima[set] - 2);
        maxima[set] = std::max(
            maxima[set],
            fit_candidate(sets, static_cast<Index>(set), static_cast<int>(i), state, threshold).evidence);
      }
    });
    return maxima;
  }

  /// One data set with so much of a candidate's column added to it.
  Data planted(const Data& data, Index set, std::size_t candidate, double amplitude) const {
    Data result(data.size());
    for (std::size_t s = 0; s < data.size(); ++s)
      for (std::size_t ratio = 0; ratio < data[s].size(); ++ratio) {
        const ScanProducts::DataProducts& y = data[s][ratio];
        result[s].push_back({y.squares.segment(set, 1), y.least.segment(set, 1), y.columns.col(set)});
        if (!columns.touches(candidate, s)) continue;
        const Index column = columns.kept(candidate, s);
        const double own = columns.products(s, ratio).candidate[candidate](0, 0),
                     with = y.columns(column, set);
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
      return fit_candidate(with, 0, static_cast<int>(candidate), strata.best_without(with, 0), critical)
                 .evidence >= critical;
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
  const ScanProducts::Data products = impl_->times(y);
  const StrataFit::State state = impl_->strata.best_without(products, 0);
  NullFit result{
      .ratio = state.ratio, .sigma = {}, .ratio_probability = {}, .log_likelihood = state.log_likelihood};
  for (std::size_t s = 0; s < state.ratio.size(); ++s) {
    const double dof = static_cast<double>(impl_->model.dof(s)) - impl_->strata.spent(products, state, s);
    result.sigma.push_back(std::sqrt(state.rss[s] / std::max(dof, 1.0)));
    std::vector<double> probability;
    for (std::size_t ratio = 0; ratio < impl_->model.ratios(); ++ratio) {
      StrataFit::State other = state;
      other.ratio[s] = ratio;
      impl_->strata.solve(products, 0, -1, other);
      probability.push_back(std::exp(std::min(0.0, other.log_likelihood - state.log_likelihood)));
    }
    double sum = 0;
    for (const double p : probability) sum += p;
    for (double& p : probability) p /= sum;
    result.ratio_probability.push_back(std::move(probability));
  }
  // Thrusts that are a quarter of the total each leave nothing between rotors: no number is divided by.
  constexpr double kRounding = 1e-9, kNone = 1e-150;
  const double largest = *std::max_element(result.sigma.begin(), result.sigma.end());
  for (double& sigma : result.sigma) sigma = std::max({sigma, kRounding * largest, kNone});
  return result;
}

std::vector<CandidateFit> CandidateScan::fit(const Components& y) const {
  const ScanProducts::Data products = impl_->times(y);
  const StrataFit::State null = impl_->strata.best_without(products, 0);
  std::vector<CandidateFit> result;
  for (std::size_t i = 0; i < impl_->candidates.size(); ++i)
    result.push_back(impl_->fit_candidate(products, 0, static_cast<int>(i), null, 0));
  return result;
}

std::vector<double> CandidateScan::simulated_maxima(const NullFit& null, std::size_t count,
                                                    std::mt19937_64& random) const {
  const std::size_t together = impl_->sets_at_once(count);
  std::vector<double> maxima;
  while (maxima.size() < count) {
    const std::vector<double> some = impl_->maxima_of(impl_->columns.times(
        impl_->simulated(null, std::min(together, count - maxima.size()), null.sizes, random)));
    maxima.insert(maxima.end(), some.begin(), some.end());
  }
  return maxima;
}

Eigen::MatrixXd CandidateScan::critical_amplitudes(const NullFit& null, double critical, std::size_t count,
                                                   std::mt19937_64& random) const {
  const ScanProducts::Data products = impl_->columns.times(impl_->simulated(null, count, {}, random));
  Eigen::MatrixXd result(count, impl_->candidates.size());
  in_two_threads(count, [&](std::size_t set) {
    for (std::size_t i = 0; i < impl_->candidates.size(); ++i)
      result(static_cast<Index>(set), static_cast<Index>(i)) =
          impl_->critical_amplitude(products, static_cast<Index>(set), i, critical);
  });
  return result;
}

}  // namespace tunnelrig
