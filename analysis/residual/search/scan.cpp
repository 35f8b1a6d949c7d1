#include "analysis/residual/search/scan.h"

#include "analysis/residual/search/fits.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace tunnelrig {
namespace {

constexpr double kKnownPhysicsWeight = 10;  // theory gives the coefficient: a prior that others lack
constexpr double kRareWeight = 10;  // stiff blades do not flex, while a Reynolds number all blades have

double prior_weight(const Term& term, const Observations& observations, std::size_t ways) {
  const Effect& effect = *term.effect;
  double weight = effect.theory() ? kKnownPhysicsWeight : 1;
  // Of a C_T that goes with the speed a cell that bends as much is the rarest cause.
  const bool bent_cell = effect.origin == EffectOrigin::kCharacteristic && observations.coefficient;
  if (effect.rare || bent_cell) weight /= kRareWeight;
  const auto rotors = static_cast<double>(observations.channels());
  if (effect.scope == EffectScope::kRotor && term.rotor >= 0) weight /= rotors;
  if (effect.scope == EffectScope::kPair) weight /= std::max(1.0, rotors * (rotors - 1));
  if (effect.has_change_point()) weight /= std::max<double>(1, static_cast<double>(ways));
  return weight;
}

/// What has another coefficient than theory's has no theory for it.
bool refuses_theory(const Term& way, const CandidateFit& fit) {
  const Effect& effect = *way.effect;
  if (!effect.theory() || effect.theory_only || !(fit.likelihood_ratio > 0)) return false;
  const double off = 1 - *effect.theory() / fit.amplitude(0);
  return fit.likelihood_ratio * off * off > kRatioOfOneParameter;
}

}  // namespace

Candidate candidate_of(const SearchData& data, const Term& way, const Eigen::MatrixXd& predicted) {
  const EffectParameter& amplitude = way.effect->parameters[0];
  const std::size_t points = data.ways_like(way);
  return {.columns = {respond(way, data.observations(), predicted).derivative[0]},
          .sign = amplitude.lower >= 0   ? 1
                  : amplitude.upper <= 0 ? -1
                                         : 0,
          .weight = prior_weight(way, data.observations(), points)};
}

void rank(const SearchData& data, const JointFit& base, Scan& scan) {
  scan.scan = std::make_unique<CandidateScan>(data.mixed(), base.linear.columns, scan.candidates);
  scan.fits = scan.scan->fit(difference(data.y(), base.linear.offset));
  for (std::size_t i = 0; i < scan.ways.size(); ++i)
    if (refuses_theory(scan.ways[i], scan.fits[i])) scan.fits[i].evidence -= std::log10(kKnownPhysicsWeight);
  scan.order.resize(scan.fits.size());
  std::iota(scan.order.begin(), scan.order.end(), 0U);
  std::sort(scan.order.begin(), scan.order.end(),
            [&](std::size_t a, std::size_t b) { return scan.fits[a].evidence > scan.fits[b].evidence; });
}

double evidence_of(const Scan& scan, const Term& term) {
  double highest = 0;
  for (std::size_t i = 0; i < scan.ways.size(); ++i)
    if (scan.ways[i].same_way(term)) highest = std::max(highest, scan.fits[i].evidence);
  return highest;
}

}  // namespace tunnelrig
