#include "analysis/residual/search/curve_scan.h"
#include "analysis/residual/search/curve_work.h"
#include "analysis/residual/search/scatter_beside.h"
#include "analysis/residual/search/search.h"

#include <optional>
#include <utility>

namespace tunnelrig {

Search::Search(const Observations& observations, const std::vector<int>& rows,
               const std::vector<const Effect*>& effects, const SearchSettings& settings)
    : whole_(observations), data_(observations, rows, effects, settings) {}

Attribution Search::run() {
  begin();
  add_effects();
  CurveScan curves = scan_curves(data_, found_);
  const auto begin_again = [&] {
    if (!begin_with_scatter_of(curves)) return false;
    add_effects();
    curves = scan_curves(data_, found_);
    return true;
  };
  // Once more where rotors differ: what was found while they were taken to be alike may have been scatter.
  if (begin_again() && data_.observations().scatter.rotors_differ()) begin_again();
  add_curves(curves);
  find_confounded();
  smooth_curves();
  measure_gains();
  forget_what_has_a_name();
  result_.session_unknown = session_scatter_is_large(data_, found_.fit);
  result_.accepted = std::move(found_.accepted);
  result_.curves = std::move(found_.curves);
  result_.beyond_bounds = std::move(found_.beyond_bounds);
  result_.final = std::move(found_.fit);
  result_.observations = data_.observations();
  result_.observations.value = whole_.value;
  result_.observations.y = whole_.y;
  result_.observations.shape = whole_.shape;
  return std::move(result_);
}

StructureLeft Search::run_on_top_of(const Attribution& found, const JointFit& whole) {
  found_ = {.fit = {}, .accepted = found.accepted, .curves = found.curves};
  found_.set_fit(whole);
  questions_ = Questions(kDrawsOnAllRuns);  // other data sets than the search before has drawn
  StructureLeft left;
  for (std::size_t t = 0; t < found_.accepted.size(); ++t)
    if (bends_away(t)) left.bent.insert(t);
  // Of single rows the seal leaves plenty, and what `hold_out` declares is not to be seen by any search.
  const bool few = !data_.observations().blocks_are_rows && data_.observations().held_out.empty();
  const std::size_t before = found_.curves.size();
  while (few && static_cast<int>(found_.curves.size()) < data_.settings().most_curves) {
    const JointFit without = found_.fit;
    if (!add_best_curve(scan_curves(data_, found_))) break;
    for (std::size_t t = 0; t < found_.accepted.size(); ++t)
      if (!found_.accepted[t].term.per_group && outshone_by_curve(data_, found_, found_.accepted[t].term))
        left.bent.insert(t);
    name_newest_curve(without);
  }
  smooth_curves(before);
  left.curves = {found_.curves.begin() + static_cast<std::ptrdiff_t>(before), found_.curves.end()};
  left.fit = std::move(found_.fit);
  left.rounds = std::move(result_.curve_rounds);
  return left;
}

bool Search::begin_with_scatter_of(const CurveScan& curves) {
  std::optional<RunScatter> scatter = other_scatter_beside(data_, found_, curves);
  if (!scatter) return false;
  data_.begin_with(std::move(*scatter));
  begin();
  return true;
}

void Search::begin() {
  found_ = {};
  found_.fit = fit_jointly(data_.observations(), {}, data_.rows());
  result_ = {};
  result_.baseline = found_.fit;
  result_.detectable_sigma = detectable_by_one(data_.mixed(), found_.fit.variances, data_.settings().alpha);
}

Attribution attribute(const Observations& observations, const std::vector<int>& rows,
                      const std::vector<const Effect*>& effects, const SearchSettings& settings) {
  return Search(observations, rows, effects, settings).run();
}

StructureLeft structure_left(const Attribution& found, const JointFit& whole, const std::vector<int>& rows,
                             const std::vector<const Effect*>& effects, const SearchSettings& settings) {
  return Search(found.observations, rows, effects, settings).run_on_top_of(found, whole);
}

}  // namespace tunnelrig
