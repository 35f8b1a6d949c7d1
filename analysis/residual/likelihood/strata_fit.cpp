#include "analysis/residual/likelihood/strata_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace tunnelrig {

using Eigen::Index;

bool StrataFit::concerns(int candidate, std::size_t s) const {
  return columns_.adopted_touch(s) ||
         (candidate >= 0 && columns_.touches(static_cast<std::size_t>(candidate), s));
}

void StrataFit::solve(const Data& data, Index set, int candidate, State& state) const {
  const Index own = candidate < 0 ? 0 : widths_[static_cast<std::size_t>(candidate)];
  const Index k = adopted_ + own;
  const std::size_t strata = model_.strata().size();
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
      state.amplitude = factored(std::move(a)).solve(b);
      for (std::size_t s = 0; s < strata; ++s)
        if (concerns(candidate, s)) state.rss[s] = residual(data, set, candidate, s, state);
    }
  }
  state.log_likelihood = 0;
  for (std::size_t s = 0; s < strata; ++s)
    state.log_likelihood += stratum_likelihood(s, state.ratio[s], state.rss[s]);
}

void StrataFit::solve_alone(const Data& data, Index set, std::size_t candidate, State& state) const {
  for (int pass = 0; pass < 2; ++pass) {
    double a = 1e-300, b = 0;
    for (std::size_t s = 0; s < model_.strata().size(); ++s) {
      if (!columns_.touches(candidate, s)) continue;
      const std::size_t ratio = state.ratio[s];
      const double weight = this->weight(s, state);
      a += weight * columns_.products(s, ratio).candidate[candidate](0, 0);
      b += weight * data[s][ratio].columns(columns_.kept(candidate, s), set);
    }
    const double amplitude = b / a;
    state.amplitude = SmallVector::Constant(1, amplitude);
    for (std::size_t s = 0; s < model_.strata().size(); ++s) {
      if (!columns_.touches(candidate, s)) continue;
      const std::size_t ratio = state.ratio[s];
      const double own = columns_.products(s, ratio).candidate[candidate](0, 0);
      const double squares = data[s][ratio].squares(set),
                   with = data[s][ratio].columns(columns_.kept(candidate, s), set);
      state.rss[s] = std::max(squares - amplitude * (2 * with - amplitude * own), data[s][ratio].least(set));
    }
  }
}

double StrataFit::weight(std::size_t s, const State& state) const {
  return static_cast<double>(model_.dof(s)) / std::max(state.rss[s], 1e-300);
}

Eigen::LDLT<SmallMatrix> StrataFit::factored(SmallMatrix normal) {
  constexpr double kRidge = 1e-10;  // well above what rounding leaves of a column that is a sum of others
  normal.diagonal().array() *= 1 + kRidge;
  normal.diagonal().array() += 1e-300;
  return normal.ldlt();
}

double StrataFit::stratum_likelihood(std::size_t s, std::size_t ratio, double rss) const {
  const double dof = static_cast<double>(model_.dof(s));
  return -0.5 * dof * std::log(std::max(rss, 1e-300) / dof) - model_.log_determinant(s, ratio);
}

void StrataFit::accumulate(const Data& data, Index set, int candidate, std::size_t s, const State& state,
                           SmallMatrix& a, SmallVector& b) const {
  const ScanProducts::Products& p = columns_.products(s, state.ratio[s]);
  const auto y = data[s][state.ratio[s]].columns.col(set);
  const double weight = this->weight(s, state);
  a.topLeftCorner(adopted_, adopted_) += weight * p.adopted_adopted;
  b.head(adopted_) += weight * y.head(adopted_);
  const auto i = static_cast<std::size_t>(candidate);
  if (candidate < 0 || columns_.kept(i, s) < 0) return;
  const Index own = a.rows() - adopted_;
  a.bottomLeftCorner(own, adopted_) +=
      weight * p.adopted_candidate.middleCols(columns_.kept(i, s), own).transpose();
  a.bottomRightCorner(own, own) += weight * p.candidate[i];
  b.tail(own) += weight * y.segment(columns_.kept(i, s), own);
}

Eigen::VectorXd StrataFit::scores(const Data& data, Index set, const State& held) const {
  const std::size_t count = widths_.size();
  const Index columns = count == 0 ? 0 : columns_.first(count - 1) + widths_.back() - adopted_;
  SmallMatrix normal = SmallMatrix::Zero(adopted_, adopted_);
  SmallVector of_adopted = SmallVector::Zero(adopted_);
  Eigen::MatrixXd beside = Eigen::MatrixXd::Zero(adopted_, columns), on_adopted = beside;
  Eigen::VectorXd with_data = Eigen::VectorXd::Zero(columns);
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(static_cast<Index>(count));
  for (std::size_t s = 0; s < held.ratio.size(); ++s) {
    const double weight = this->weight(s, held);
    const ScanProducts::Products& p = columns_.products(s, held.ratio[s]);
    const auto y = data[s][held.ratio[s]].columns.col(set);
    const bool adopted_touch = columns_.adopted_touch(s);
    if (adopted_touch) accumulate(data, set, -1, s, held, normal, of_adopted);
    squares += weight * p.squares;
    for (std::size_t i = 0; i < count; ++i) {
      const Index kept = columns_.kept(i, s), first = columns_.first(i) - adopted_;
      if (kept < 0) continue;
      with_data.segment(first, widths_[i]) += weight * y.segment(kept, widths_[i]);
      if (adopted_touch)
        beside.middleCols(first, widths_[i]) += weight * p.adopted_candidate.middleCols(kept, widths_[i]);
    }
  }
  if (adopted_ > 0) {
    on_adopted = factored(std::move(normal)).solve(beside);
    with_data -= on_adopted.transpose() * of_adopted;
  }
  Eigen::VectorXd result(count);
  for (std::size_t i = 0; i < count; ++i) {
    const Index own = widths_[i], first = columns_.first(i) - adopted_;
    double& of_this = result(static_cast<Index>(i));
    if (own == 1) {
      const double information =
          squares(static_cast<Index>(i)) - beside.col(first).dot(on_adopted.col(first));
      of_this = 0.5 * with_data(first) * with_data(first) / std::max(information, 1e-300);
      continue;
    }
    SmallMatrix information = -beside.middleCols(first, own).transpose() * on_adopted.middleCols(first, own);
    for (std::size_t s = 0; s < held.ratio.size(); ++s)
      if (columns_.touches(i, s))
        information += weight(s, held) * columns_.products(s, held.ratio[s]).candidate[i];
    const auto score = with_data.segment(first, own);
    of_this = 0.5 * score.dot(factored(std::move(information)).solve(score));
  }
  return result;
}

double StrataFit::spent(const Data& data, const State& state, std::size_t stratum) const {
  if (adopted_ == 0) return static_cast<double>(columns_.taken_out());
  SmallMatrix all = SmallMatrix::Zero(adopted_, adopted_), own = all;
  SmallVector unused = SmallVector::Zero(adopted_);
  for (std::size_t s = 0; s < model_.strata().size(); ++s) {
    accumulate(data, 0, -1, s, state, all, unused);
    if (s == stratum) accumulate(data, 0, -1, s, state, own, unused);
  }
  const Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> solver(all);
  return solver.solve(Eigen::MatrixXd(own)).trace();
}

double StrataFit::residual(const Data& data, Index set, int candidate, std::size_t s,
                           const State& state) const {
  const ScanProducts::Products& p = columns_.products(s, state.ratio[s]);
  const ScanProducts::DataProducts& y = data[s][state.ratio[s]];
  const auto of_adopted = state.amplitude.head(adopted_);
  SmallVector made = p.adopted_adopted * of_adopted;
  double gained = 2 * of_adopted.dot(y.columns.col(set).head(adopted_)) - of_adopted.dot(made);
  if (const auto i = static_cast<std::size_t>(candidate); candidate >= 0 && columns_.kept(i, s) >= 0) {
    const Index own = state.amplitude.size() - adopted_;
    const auto of_own = state.amplitude.tail(own);
    made = p.adopted_candidate.middleCols(columns_.kept(i, s), own).transpose() * of_adopted;
    gained += 2 * of_own.dot(y.columns.col(set).segment(columns_.kept(i, s), own) - made) -
              of_own.dot(p.candidate[i] * of_own);
  }
  return std::max(y.squares(set) - gained, y.least(set));
}

StrataFit::State StrataFit::best_without(const Data& data, Index set) const {
  constexpr double kRounding = 1e-7;  // where no two blocks share a group, all ratios are as likely
  State best{.ratio = std::vector<std::size_t>(model_.strata().size(), 0), .rss = {}, .amplitude = {}};
  for (std::size_t s = 0; s < best.ratio.size(); ++s) {
    double highest = -std::numeric_limits<double>::infinity();
    for (std::size_t ratio = 0; ratio < model_.ratios(); ++ratio) {
      const double value = stratum_likelihood(s, ratio, data[s][ratio].squares(set));
      if (value > highest + kRounding) {
        highest = value;
        best.ratio[s] = ratio;
      }
    }
  }
  solve(data, set, -1, best);
  if (adopted_ > 0) improve(data, set, -1, best);
  return best;
}

void StrataFit::improve(const Data& data, Index set, int candidate, State& best) const {
  State tried;  // keeps its memory
  for (std::size_t s = 0; s < model_.strata().size(); ++s) {
    if (candidate < 0 ? !columns_.adopted_touch(s)
                      : !columns_.touches(static_cast<std::size_t>(candidate), s))
      continue;
    const std::size_t start = best.ratio[s], lowest = candidate < 0 ? 0 : lowest_tried(start);
    const auto is_better_at = [&](std::size_t ratio) {
      tried = best;
      tried.ratio[s] = ratio;
      solve(data, set, candidate, tried);
      if (!(tried.log_likelihood > best.log_likelihood)) return false;
      std::swap(best, tried);
      return true;
    };
    while (best.ratio[s] > lowest && is_better_at(best.ratio[s] - 1)) {
    }
    if (candidate >= 0 || best.ratio[s] < start) continue;
    while (best.ratio[s] + 1 < model_.ratios() && is_better_at(best.ratio[s] + 1)) {
    }
  }
}

}  // namespace tunnelrig
