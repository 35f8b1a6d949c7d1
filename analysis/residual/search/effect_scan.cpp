#include "analysis/residual/search/effect_scan.h"

#include "analysis/residual/likelihood/testability.h"
#include "analysis/residual/search/curve_work.h"
#include "analysis/residual/search/group_amplitudes.h"
#include "analysis/residual/search/together.h"

#include <algorithm>
#include <utility>

namespace tunnelrig {
namespace {

/// Whether more of an effect than physics allows was found, and is described by a curve: what is left of it
/// on one rotor is no effect of its own.
bool was_beyond_bounds(const SearchData& data, const Found& found, const Term& way) {
  return std::ranges::any_of(found.beyond_bounds, [&](const BeyondBounds& beyond) {
    return beyond.term.effect->name == way.effect->name &&
           std::ranges::any_of(found.curves, [&](const FoundCurve& described) {
             return is_over(described.curve, own_conditions(*way.effect, data.observations()));
           });
  });
}

/// Without fits.
Scan list_effects(const SearchData& data, const Found& found, const JointFit& base) {
  Scan scan;
  const Eigen::MatrixXd predicted = predict_response(data.observations(), base.model, data.rows());
  for (const Term& way : data.ways()) {
    if (already_in(way, base.model, data.observations().channels()) || was_beyond_bounds(data, found, way))
      continue;
    Candidate candidate = candidate_of(data, way, predicted);
    const Components& column = candidate.columns[0];
    if (is_work_of_a_curve(data, found.curves, way, column[0], predicted) || !data.mixed().sees(column))
      continue;
    scan.ways.push_back(way);
    scan.candidates.push_back(std::move(candidate));
  }
  return scan;
}

/// Only effects that may have either sign: of the others, what all groups have in common is seen first.
void add_group_ways(const SearchData& data, Scan& scan) {
  const std::vector<int> groups = groups_among(data.observations(), data.rows());
  if (groups.size() < 2 || groups.size() > kMostGroups) return;
  const std::size_t alike = scan.ways.size();
  for (std::size_t i = 0; i < alike; ++i) {
    const auto& parameters = scan.ways[i].effect->parameters;
    if (goes_by_the_law_alone(*scan.ways[i].effect, data.observations())) continue;
    if (parameters.size() > 1 || parameters[0].theory || parameters[0].lower >= 0 || parameters[0].upper <= 0)
      continue;
    Candidate own{
        .columns = columns_by_group(scan.candidates[i].columns[0], data.observations(), groups, data.mixed()),
        .sign = 0,
        .weight = kWeightInGroups};
    if (own.columns.size() < 2) continue;
    scan.ways.push_back(scan.ways[i]);
    scan.ways.back().per_group = true;
    scan.candidates.push_back(std::move(own));
  }
}

}  // namespace

bool already_in(const Term& way, const MeanModel& model, Eigen::Index channels) {
  const auto is_of = [&](const Term& term) {
    const bool another_step =
        way.effect->has_change_point() && !std::equal(way.parameters.begin() + 1, way.parameters.end(),
                                                      term.parameters.begin() + 1, term.parameters.end());
    return term.effect->cause() == way.effect->cause() && !another_step && term.other == way.other;
  };
  const auto of_own_rotor = std::ranges::count_if(
      model.terms, [&](const Term& term) { return is_of(term) && term.rotor == way.rotor; });
  // What all do beside what single ones do is one more, as long as one has none of its own.
  const auto of_single =
      std::ranges::count_if(model.terms, [&](const Term& term) { return is_of(term) && term.rotor >= 0; });
  return of_own_rotor > 0 || (way.rotor < 0 && of_single >= channels);
}

Scan scan_effects(const SearchData& data, const Found& found, const JointFit& base) {
  Scan scan = list_effects(data, found, base);
  rank(data, base, scan);
  return scan;
}

Scan scan_effects_and_groups(const SearchData& data, const Found& found) {
  Scan scan = list_effects(data, found, found.fit);
  if (data.observations().from_table) {
    add_group_ways(data, scan);
    add_several_axes(scan);
  } else {
    add_pairs_of_steps(data, found.fit.variances, scan);
  }
  rank(data, found.fit, scan);
  return scan;
}

}  // namespace tunnelrig
