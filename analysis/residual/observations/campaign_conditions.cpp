#include "analysis/residual/observations/campaign_conditions.h"

#include "analysis/effects/effect.h"
#include "analysis/spectrum.h"
#include "datasets/locations.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include <fmt/format.h>

namespace tunnelrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

constexpr double kNoTare = std::numeric_limits<double>::quiet_NaN();

std::set<std::string> conditions_of_zeros() {
  std::set<std::string> names;
  for (const Effect& effect : all_effects())
    if (effect.of_zero) names.insert(effect.covariates.begin(), effect.covariates.end());
  return names;
}

class AtZero {
 public:
  AtZero(const CampaignData& data, const Reduction& reduction, const std::vector<std::size_t>& order,
         const Observations& observations)
      : data_(data), tares_(recorded_runs(data, RunKind::kTare)), observations_(observations) {
    for (const std::size_t r : order) runs_.push_back(&reduction.runs[r]);
  }

  bool any() const {
    return std::ranges::any_of(runs_, [](const RunCoefficients* run) { return run->tare.has_value(); });
  }

  MatrixXd of(const Covariate& covariate) {
    MatrixXd result = MatrixXd::Constant(covariate.value.rows(), covariate.value.cols(), kNoTare);
    for (Index row = 0; row < result.rows(); ++row)
      for (Index channel = 0; channel < result.cols() && coefficients(row).tare; ++channel) {
        // From the first tare's on: of equal values the mean is that value, and nothing is left of rounding.
        const std::vector<TareZero::Weight>& weights = coefficients(row).tare->weights;
        const double first = at_tare(covariate, tares_[weights.front().tare], row, channel);
        result(row, channel) = first;
        for (const TareZero::Weight& weight : weights)
          result(row, channel) +=
              weight.weight * (at_tare(covariate, tares_[weight.tare], row, channel) - first);
      }
    return result;
  }

  /// Tares whose row lacks a condition, of those that `of` was asked for.
  const std::map<std::string, std::set<std::size_t>>& lacking() const { return lacking_; }

 private:
  const RunCoefficients& coefficients(Index row) const { return *runs_[static_cast<std::size_t>(row)]; }
  const Run& run(Index row) const { return data_.runs[coefficients(row).run]; }

  double at_tare(const Covariate& covariate, std::size_t tare, Index row, Index channel) {
    const Run& at = data_.runs[tare];
    if (covariate.name == "run_order") return order_at(at, row);
    if (covariate.name == "hours_in_session")
      return covariate.value(row, 0) + (at.start_s - run(row).start_s) / 3600;
    if (covariate.name == "mains_amplitude_V")
      return mains_amplitude_V(data_.statistics.at(at.run).channels[static_cast<std::size_t>(channel)],
                               data_.info.daq);
    if (const auto value = condition(at, covariate.name)) return *value;
    lacking_[covariate.name].insert(tare);
    return nearest(covariate, at);
  }

  /// A change at a session's first run was there at its tares as well. Between two tares a run's zero is of
  /// both sides: what changed there is nowhere taken off as a whole, and left to neither.
  double order_at(const Run& tare, Index row) const {
    if (coefficients(row).tare->weights.size() > 1) return static_cast<double>(row);
    Index last = row;
    for (Index other = 0; other < observations_.rows(); ++other) {
      if (run(other).session != tare.session) continue;
      if (run(other).start_s >= tare.start_s) return static_cast<double>(other);
      last = other;
    }
    return static_cast<double>(last);
  }

  double nearest(const Covariate& covariate, const Run& tare) const {
    double value = kNoTare, least = std::numeric_limits<double>::infinity();
    for (Index row = 0; row < observations_.rows(); ++row) {
      const double apart = std::abs(run(row).start_s - tare.start_s);
      if (run(row).session != tare.session || std::isnan(covariate.value(row, 0)) || apart >= least) continue;
      least = apart;
      value = covariate.value(row, 0);
    }
    return value;
  }

  const CampaignData& data_;
  std::vector<std::size_t> tares_;  // runs, in the order of the reduction's tares
  const Observations& observations_;
  std::vector<const RunCoefficients*> runs_;  // of each row
  std::map<std::string, std::set<std::size_t>> lacking_;
};

}  // namespace

std::optional<double> condition(const Run& run, const std::string& name) {
  const auto value = run.number(name);
  if (value) return value;
  if (name == kGroundDistance) return distance_of(run.location, "GND");
  if (name == kCeilingDistance) return distance_of(run.location, "CEIL");
  return {};
}

void set_conditions_at_zero(const CampaignData& data, const Reduction& reduction,
                            const std::vector<std::size_t>& order, Observations& observations) {
  AtZero at_zero(data, reduction, order, observations);
  if (!at_zero.any()) return;
  const std::set<std::string> names = conditions_of_zeros();
  for (Covariate& covariate : observations.covariates)
    if (names.contains(covariate.name)) covariate.at_zero = at_zero.of(covariate);
  for (const auto& [name, tares] : at_zero.lacking())
    observations.left_out.push_back(fmt::format(
        "{} is empty in {} of {} tares: taken from the run of the session that is nearest in time", name,
        tares.size(), reduction.tares.readings().size()));
}

}  // namespace tunnelrig
