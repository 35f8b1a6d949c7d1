#include "analysis/residual/observations/observations.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

namespace tunnelrig {
namespace {

template <class T>
std::vector<T> picked(const std::vector<T>& from, const std::vector<int>& rows) {
  std::vector<T> result;
  if (from.empty()) return result;
  for (const int row : rows) result.push_back(from[static_cast<std::size_t>(row)]);
  return result;
}

/// Run numbers among `kept`, for those at which zeros were taken: of a run that is left out, the next of its
/// block, or the last.
Eigen::MatrixXd renumbered(const Eigen::MatrixXd& run_numbers, const std::vector<int>& kept,
                           const std::vector<int>& block) {
  const auto block_of = [&](int row) { return block[static_cast<std::size_t>(row)]; };
  return run_numbers.unaryExpr([&](double number) {
    if (std::isnan(number)) return number;
    auto next = std::ranges::lower_bound(kept, number);
    const bool beyond = next == kept.end() || block_of(*next) != block_of(static_cast<int>(number));
    if (beyond && next != kept.begin()) --next;
    return static_cast<double>(next - kept.begin());
  });
}

/// Numbers without gaps, in the same order, and the names that they have.
void close_gaps(std::vector<int>& number, std::vector<std::string>& name) {
  std::map<int, int> closed;
  for (const int old : number) closed[old] = 0;
  std::vector<std::string> names;
  for (auto& [old, fresh] : closed) {
    fresh = static_cast<int>(names.size());
    names.push_back(name[static_cast<std::size_t>(old)]);
  }
  for (int& each : number) each = closed.at(each);
  name = std::move(names);
}

}  // namespace

std::map<int, std::vector<Eigen::Index>> places_of_each(const std::vector<int>& number,
                                                        const std::vector<int>& rows) {
  std::map<int, std::vector<Eigen::Index>> places;
  for (std::size_t r = 0; r < rows.size(); ++r)
    places[number[static_cast<std::size_t>(rows[r])]].push_back(static_cast<Eigen::Index>(r));
  return places;
}

std::map<int, std::vector<Eigen::Index>> places_of_each(const std::vector<int>& number) {
  std::map<int, std::vector<Eigen::Index>> places;
  for (std::size_t r = 0; r < number.size(); ++r) places[number[r]].push_back(static_cast<Eigen::Index>(r));
  return places;
}

std::map<int, std::vector<int>> rows_of_each(const std::vector<int>& number, const std::vector<int>& rows) {
  std::map<int, std::vector<int>> result;
  for (const int row : rows) result[number[static_cast<std::size_t>(row)]].push_back(row);
  return result;
}

std::vector<std::vector<Eigen::Index>> without_numbers(
    const std::map<int, std::vector<Eigen::Index>>& places) {
  std::vector<std::vector<Eigen::Index>> result;
  for (const auto& [number, own] : places) result.push_back(own);
  return result;
}

Covariate covariate_of_texts(const std::string& name, const std::vector<std::string>& texts) {
  const std::set<std::string> different(texts.begin(), texts.end());
  Covariate covariate{name, Eigen::MatrixXd(static_cast<Eigen::Index>(texts.size()), 1)};
  covariate.labels.assign(different.begin(), different.end());
  for (std::size_t row = 0; row < texts.size(); ++row)
    covariate.value(static_cast<Eigen::Index>(row), 0) =
        1 + static_cast<double>(std::distance(different.begin(), different.find(texts[row])));
  return covariate;
}

std::vector<double> at_zero(const std::vector<const Covariate*>& covariates, Eigen::Index run,
                            Eigen::Index channel) {
  std::vector<double> result;
  for (const Covariate* covariate : covariates) {
    if (covariate->at_zero.size() == 0 || std::isnan(covariate->zero(run, channel))) return {};
    result.push_back(covariate->zero(run, channel));
  }
  return result;
}

std::vector<int> Observations::all_rows() const {
  std::vector<int> all(static_cast<std::size_t>(rows()));
  std::iota(all.begin(), all.end(), 0);
  return all;
}

Eigen::VectorXd RunScatter::of_runs(const std::vector<int>& rows) const {
  Eigen::VectorXd result = Eigen::VectorXd::Ones(static_cast<Eigen::Index>(rows.size()));
  for (const Eigen::VectorXd* scatter : {&runs, &by_condition.runs})
    if (scatter->size() > 0) result.array() *= (*scatter)(rows).array();
  return result;
}

RunScatter RunScatter::subset(const std::vector<int>& kept) const {
  RunScatter part = *this;
  for (Eigen::VectorXd* scatter : {&part.runs, &part.by_condition.runs})
    if (scatter->size() > 0) *scatter = Eigen::VectorXd((*scatter)(kept));
  return part;
}

Observations Observations::without_responses_but(const std::vector<int>& open) const {
  Observations result = *this;
  const auto hide = [&](Eigen::MatrixXd& responses, const Eigen::MatrixXd& all) {
    responses.setConstant(std::numeric_limits<double>::quiet_NaN());
    responses(open, Eigen::all) = all(open, Eigen::all);
  };
  hide(result.value, value);
  hide(result.y, y);
  for (std::size_t j = 0; j < shape.size(); ++j) hide(result.shape[j], shape[j]);
  return result;
}

Observations Observations::subset(const std::vector<int>& kept) const {
  Observations part = *this;
  for (Eigen::MatrixXd* matrix : {&part.value, &part.known, &part.y, &part.slopes})
    *matrix = Eigen::MatrixXd((*matrix)(kept, Eigen::all));
  for (Eigen::MatrixXd& course : part.shape) course = Eigen::MatrixXd(course(kept, Eigen::all));
  if (beyond.size() > 0) part.beyond = Eigen::MatrixXd(beyond(kept, Eigen::all));
  if (sign.size() > 0) part.sign = Eigen::VectorXd(sign(kept));
  part.scatter = scatter.subset(kept);
  for (Place& place : part.places) place.weight = Eigen::VectorXd(place.weight(kept));
  part.duration_s = Eigen::VectorXd(duration_s(kept));
  for (Covariate& covariate : part.covariates) {
    covariate.value = Eigen::MatrixXd(covariate.value(kept, Eigen::all));
    if (covariate.at_zero.size() == 0) continue;
    covariate.at_zero = Eigen::MatrixXd(covariate.at_zero(kept, Eigen::all));
    if (covariate.name == "run_order") covariate.at_zero = renumbered(covariate.at_zero, kept, block);
  }
  part.name = picked(name, kept);
  part.group = picked(group, kept);
  part.block = picked(block, kept);
  close_gaps(part.group, part.group_name);
  close_gaps(part.block, part.block_name);
  part.in_tunnel = picked(in_tunnel, kept);
  part.previous = picked(previous, kept);
  std::vector<int> place(static_cast<std::size_t>(rows()), -1);
  for (std::size_t k = 0; k < kept.size(); ++k)
    place[static_cast<std::size_t>(kept[k])] = static_cast<int>(k);
  for (int& before : part.previous)
    if (before >= 0) before = place[static_cast<std::size_t>(before)];
  part.held_out = picked(held_out, kept);
  if (position.size() > 0) part.position = Eigen::VectorXd(position(kept));
  return part;
}

}  // namespace tunnelrig
