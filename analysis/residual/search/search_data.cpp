#include "analysis/residual/search/search_data.h"

#include "analysis/residual/search/ways.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace tunnelrig {
namespace {

std::string effect_and_rotor(const Term& way) { return way.effect->name + std::to_string(way.rotor); }

}  // namespace

SearchData::SearchData(const Observations& observations, const std::vector<int>& rows,
                       const std::vector<const Effect*>& effects, const SearchSettings& settings)
    : rows_(rows),
      effects_(effects),
      settings_(settings),
      given_(observations.without_responses_but(rows)),
      observations_(given_),
      curves_to_try_(tunnelrig::curves_to_try(given_, rows)),
      y_(response_components(given_)) {
  make_models();
  list_ways();
}

std::size_t SearchData::ways_like(const Term& way) const { return ways_of_.at(effect_and_rotor(way)); }

void SearchData::begin_with(RunScatter scatter) {
  observations_ = given_;
  observations_.scatter = std::move(scatter);
  make_models();
  list_ways();
}

void SearchData::set_observations(Observations observations) {
  observations_ = std::move(observations);
  make_models();
}

void SearchData::make_models() {
  mixed_ = std::make_unique<MixedModel>(observations_, rows_);
  baseline_ = std::make_unique<MixedModel>(MixedModel::baseline_alone(observations_, rows_));
}

void SearchData::list_ways() {
  ways_ = all_ways(effects_, observations_, rows_);
  const OwnEvidence has_evidence(observations_, *baseline_);
  const auto taken_back = [&](const Term& way) {
    return std::ranges::any_of(settings_.taken_back, [&](const Term& term) {
      return term.effect->cause() == way.effect->cause() && term.rotor == way.rotor &&
             term.other == way.other;
    });
  };
  std::erase_if(ways_, [&](const Term& way) { return taken_back(way) || !has_evidence(way); });
  ways_of_.clear();
  for (const Term& way : ways_) ++ways_of_[effect_and_rotor(way)];
}

double rms_beside_baseline(const SearchData& data, const Eigen::MatrixXd& column) {
  constexpr double kRounding = 1e-14;  // of the squares, as MixedModel::sees
  const Observations& observations = data.observations();
  const MixedModel& baseline = data.baseline();
  Components components(1 + observations.shape.size(),
                        Eigen::MatrixXd::Zero(observations.rows(), observations.channels()));
  components[0] = column;
  double whole = 0, squares = 0;
  Eigen::Index count = 0;
  for (std::size_t s = 0; s < baseline.strata().size(); ++s) {
    if (!baseline.strata()[s].means()) continue;
    Stacked stacked = baseline.stack(s, {&components});
    whole += stacked.squaredNorm();
    baseline.project(s, 0, stacked);
    squares += stacked.squaredNorm();
    count += stacked.size();
  }
  return squares > kRounding * whole ? std::sqrt(squares / static_cast<double>(count)) : 0;
}

}  // namespace tunnelrig
