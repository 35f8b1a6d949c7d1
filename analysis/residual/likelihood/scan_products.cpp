#include "analysis/residual/likelihood/scan_products.h"

#include "analysis/residual/likelihood/in_two_threads.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace tunnelrig {

using Eigen::Index;
using Eigen::MatrixXd;

ScanProducts::ScanProducts(const MixedModel& model, const std::vector<Components>& adopted,
                           const std::vector<Candidate>& candidates)
    : model_(model), adopted_(static_cast<Index>(adopted.size())) {
  std::vector<const Components*> items = pointers_to(adopted);
  for (const Candidate& candidate : candidates) {
    first_.push_back(static_cast<Index>(items.size()));
    for (const Components& column : candidate.columns) items.push_back(&column);
  }
  all_ = static_cast<Index>(items.size());
  const std::size_t strata = model.strata().size();
  for (std::size_t s = 0; s < strata; ++s) {
    project(s, items);
    place(s, candidates);
    sessions_.emplace_back(model, s);
    by_session_.push_back(sessions_[s].coordinates(projected_[s]));
  }
  products_.resize(strata);
  in_two_threads(strata, [&](std::size_t s) { products_[s] = multiply(s, candidates); });
  for (std::size_t s = 0; s < strata; ++s) {
    touches_.emplace_back();
    for (const double squares : products_[s][0].squares) touches_[s].push_back(squares > 0);
  }
  if (strata == 1 && adopted_ > 0) take_out_adopted();
}

void ScanProducts::take_out_adopted() {
  constexpr double kRidge = 1e-10, kLeast = 1e-300;  // a sum of the adopted leaves nothing
  const Index q = adopted_;
  taken_out_ = products_[0][0].adopted_adopted.completeOrthogonalDecomposition().rank();
  for (Products& products : products_[0]) {
    MatrixXd normal = products.adopted_adopted;
    normal.diagonal() = normal.diagonal().array() * (1 + kRidge) + kLeast;
    normal_of_adopted_.emplace_back(normal);
    const MatrixXd on_adopted = normal_of_adopted_.back().solve(products.adopted_candidate);
    for (std::size_t i = 0; i < products.candidate.size(); ++i) {
      MatrixXd& own = products.candidate[i];
      own.diagonal() *= 1 + kRidge;
      own -= products.adopted_candidate.middleCols(first_[i], own.cols()).transpose() *
             on_adopted.middleCols(first_[i], own.cols());
    }
    set_squares(products);
    products.adopted_adopted.resize(0, 0);
    on_adopted_.emplace_back(on_adopted.rightCols(all_ - q));
    products.adopted_candidate.resize(0, all_ - q);
  }
  for (Index& first : first_) first -= q;
  for (Index& kept : kept_[0]) kept -= q;
  adopted_ = 0;
}

void ScanProducts::take_out_adopted(std::vector<DataProducts>& data) const {
  for (std::size_t ratio = 0; ratio < data.size(); ++ratio) {
    auto& [squares, least, columns] = data[ratio];
    const Index q = normal_of_adopted_[ratio].rows();
    const MatrixXd adopted = columns.topRows(q);
    squares -= adopted.cwiseProduct(normal_of_adopted_[ratio].solve(adopted)).colwise().sum().transpose();
    squares = squares.cwiseMax(least).eval();
    columns = (columns.bottomRows(columns.rows() - q) - on_adopted_[ratio].transpose() * adopted).eval();
  }
}

void ScanProducts::project(std::size_t stratum, const std::vector<const Components*>& items) {
  constexpr double kNothing = 1e-14;  // of a column's squares: rounding is left of what the baseline has
  std::vector<const Components*> not_0;
  std::vector<Index> columns;
  for (std::size_t i = 0; i < items.size(); ++i)
    if (!(*items[i])[model_.strata()[stratum].component].isZero(0)) {
      columns.push_back(static_cast<Index>(i));
      not_0.push_back(items[i]);
    }
  Stacked left = model_.stack(stratum, not_0);
  const Eigen::VectorXd squares = left.colwise().squaredNorm();
  model_.project(stratum, 0, left);
  std::vector<Index> kept, used;
  for (Index c = 0; c < left.cols(); ++c)
    if (left.col(c).squaredNorm() > kNothing * squares(c)) {
      kept.push_back(c);
      used.push_back(columns[static_cast<std::size_t>(c)]);
    }
  if (static_cast<Index>(kept.size()) == left.cols())
    projected_.push_back(std::move(left));
  else
    projected_.emplace_back(left(Eigen::all, kept));
  used_.push_back(std::move(used));
}

void ScanProducts::place(std::size_t stratum, const std::vector<Candidate>& candidates) {
  const std::vector<Index>& used = used_[stratum];
  const bool all = model_.strata().size() == 1;  // where the adopted are taken out, of all
  std::vector<Index>& kept = kept_.emplace_back();
  std::vector<Index>& rows = rows_.emplace_back();
  auto next = std::ranges::lower_bound(used, adopted_);
  rows.assign(used.begin(), next);
  Index size = adopted_;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    const Index own = std::ssize(candidates[i].columns), first = first_[i];
    const bool keep = all || (next != used.end() && *next < first + own);
    kept.push_back(keep ? size : -1);
    for (; next != used.end() && *next < first + own; ++next) rows.push_back(size + *next - first);
    if (keep) size += own;
  }
  how_many_kept_.push_back(size);
}

std::vector<ScanProducts::Products> ScanProducts::multiply(std::size_t stratum,
                                                           const std::vector<Candidate>& candidates) const {
  const auto among_kept = [&](const Stacked& of_used) {
    Stacked result = Stacked::Zero(of_used.rows(), how_many_kept_[stratum]);
    result(Eigen::all, rows_[stratum]) = of_used;
    return result;
  };
  const Stacked c = among_kept(projected_[stratum]), in_sessions = among_kept(by_session_[stratum]);
  std::vector<Products> result(model_.ratios());
  for (std::size_t ratio = 0; ratio < model_.ratios(); ++ratio) {
    const Stacked weighted = sessions_[stratum].weighted(ratio, in_sessions);
    const auto product = [&](Index first_a, Index a, Index first_b, Index b) -> MatrixXd {
      return c.middleCols(first_a, a).transpose() * c.middleCols(first_b, b) -
             in_sessions.middleCols(first_a, a).transpose() * weighted.middleCols(first_b, b);
    };
    Products& own = result[ratio];
    own.adopted_adopted = product(0, adopted_, 0, adopted_);
    own.adopted_candidate = product(0, adopted_, 0, c.cols());
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      const auto width = static_cast<Index>(candidates[i].columns.size());
      const Index kept = kept_[stratum][i];
      own.candidate.push_back(kept < 0 ? MatrixXd(MatrixXd::Zero(width, width))
                                       : product(kept, width, kept, width));
    }
    set_squares(own);
  }
  return result;
}

void ScanProducts::set_squares(Products& products) {
  products.squares.resize(std::ssize(products.candidate));
  for (std::size_t i = 0; i < products.candidate.size(); ++i)
    products.squares(static_cast<Index>(i)) = products.candidate[i].trace();
}

ScanProducts::Data ScanProducts::times(const std::vector<Stacked>& data) const {
  Data result(data.size(), std::vector<DataProducts>(model_.ratios()));
  for (std::size_t s = 0; s < data.size(); ++s)
    for (DataProducts& products : result[s]) {
      products.squares.resize(data[s].cols());
      products.least.resize(data[s].cols());
      products.columns = MatrixXd::Zero(how_many_kept_[s], data[s].cols());
    }
  in_two_threads(2 * data.size(), [&](std::size_t k) {  // half of a stratum's data sets
    const Stacked& sets = data[k / 2];
    const Index half = sets.cols() / 2;
    if (k % 2 == 0)
      multiply(k / 2, sets.leftCols(half), 0, result[k / 2]);
    else
      multiply(k / 2, sets.rightCols(sets.cols() - half), half, result[k / 2]);
  });
  if (!normal_of_adopted_.empty()) take_out_adopted(result[0]);
  return result;
}

void ScanProducts::multiply(std::size_t stratum, Stacked sets, Index from,
                            std::vector<DataProducts>& result) const {
  constexpr double kRounding = 1e-12;
  model_.project(stratum, 0, sets);
  const SessionDirections& sessions = sessions_[stratum];
  const Stacked in_sessions = sessions.coordinates(sets);
  const Eigen::VectorXd squares = sets.colwise().squaredNorm();
  const MatrixXd columns = projected_[stratum].transpose() * sets;
  for (std::size_t ratio = 0; ratio < model_.ratios(); ++ratio) {
    const Stacked weighted = sessions.weighted(ratio, in_sessions);
    auto own = result[ratio].squares.segment(from, sets.cols());
    own = squares - weighted.cwiseProduct(in_sessions).colwise().sum().transpose();
    result[ratio].least.segment(from, sets.cols()) = kRounding * own;
    result[ratio].columns(rows_[stratum], Eigen::seqN(from, sets.cols())) =
        columns - by_session_[stratum].transpose() * weighted;
  }
}

}  // namespace tunnelrig
