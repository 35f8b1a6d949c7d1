// What speaks against an explanation that was found: the opened seal, the intervals, readings that scatter,
// rows that are alike.
#include "analysis/residual/explanation/explanation_parts.h"
#include "analysis/residual/scatter/run_correlation.h"
#include "analysis/upper_median.h"
#include "datasets/first_few.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>

#include <fmt/format.h>

namespace tunnelrig {

using Eigen::Index;
using Eigen::VectorXd;

void warn_of_bounds(const Observations& observations, const Attribution& found, Explanation& explanation) {
  std::set<std::string> said;  // of each effect once
  for (const Accepted& accepted : found.accepted) said.insert(accepted.term.effect->name);
  for (const BeyondBounds& beyond : found.beyond_bounds) {
    const Effect& effect = *beyond.term.effect;
    if (!said.insert(effect.name).second) continue;
    const EffectParameter& amplitude = effect.parameters[0];
    const std::string own = unit_of(observations, effect, 0), unit = own == "1" ? "" : " " + own;
    explanation.warnings.push_back(fmt::format(
        "of all candidates {} fitted best by far, but its {} would be {:.3g}{}, and its physical bounds are "
        "{:.3g} to {:.3g}{}: it is not named, and what is found beside it may be its work",
        beyond.term.label(), amplitude.name, beyond.amplitude, unit, amplitude.lower, amplitude.upper, unit));
  }
}

/// What the opened seal and the intervals say against what was adopted.
void warn_of_doubts(Explanation& explanation) {
  for (const AdoptedEffect& adopted : explanation.adopted) {
    for (const ParameterEstimate& parameter : adopted.parameters)
      if (parameter.theory && (parameter.value < parameter.low || parameter.value > parameter.high))
        explanation.warnings.push_back(fmt::format(
            "{}: its {} is theory's {:.4g}, and the data alone say {:.4g} to {:.4g}: something else goes "
            "with it",
            adopted.term.label(), parameter.name, parameter.value, parameter.low, parameter.high));
    const ParameterEstimate& amplitude = adopted.parameters[0];
    const std::optional<double> theory = adopted.term.effect->theory();
    if (theory && !amplitude.theory && !adopted.term.per_group &&
        (*theory < amplitude.low || *theory > amplitude.high))
      explanation.warnings.push_back(
          fmt::format("{}: its {} is {:.4g} to {:.4g}, and theory says {:.4g}: something else goes with it",
                      adopted.term.label(), amplitude.name, amplitude.low, amplitude.high, *theory));
  }
  constexpr double kFarAbove = 3;
  const double error = explanation.after.held_out_rmse;
  if (explanation.noise_floor > explanation.after.held_out_high)
    explanation.warnings.emplace_back(
        "the noise floor is above all of the error's interval: the sealed blocks are calm by chance (in one "
        "campaign of twenty-five without any fault), or it is too high, since the rows scatter less evenly "
        "than its variances can follow, or curves are not known where these blocks are");
  else if (explanation.noise_floor > kFarAbove * error)  // whose interval reaches that far by a few rows
    explanation.warnings.push_back(fmt::format(
        "the noise floor is {:.2g} times the error: a stretch of open rows is far off, of which "
        "suspect_rows need not have any, or scatters far more than the rest, and the floor is too "
        "high",
        explanation.noise_floor / error));
  const SealedErrors& sealed = explanation.sealed;
  const bool worse = explanation.after.held_out_rmse > explanation.before.held_out_rmse;
  if (worse && sealed.all < std::min(sealed.curves, explanation.before.held_out_rmse)) {
    explanation.warnings.push_back(
        fmt::format("on the sealed blocks the error is larger with the names alone than without; beside the "
                    "curves they make it smaller ({:.4g}, without them {:.4g}): adopt them together "
                    "(--adopt-empirical)",
                    sealed.all, sealed.curves));
    return;
  }
  if (sealed.beyond_floor)
    explanation.warnings.push_back(
        fmt::format("on the sealed blocks the error with all that was found is {:.2g} times the noise floor: "
                    "something else varies there",
                    sealed.all / explanation.noise_floor));
  if (worse &&
      (sealed.against_adopted || is_worse(explanation.after.held_out_rmse, explanation.before.held_out_rmse)))
    explanation.warnings.emplace_back(
        "on the sealed blocks the error is larger with what was adopted than without: doubt it");
  else if (worse && !sealed.beyond_floor)
    explanation.warnings.emplace_back(
        "on the sealed blocks what was adopted does little: that the error is larger with it than without is "
        "chance, and says neither that it is right nor that it is wrong");
}

void warn_of_noisy_speed(const Observations& observations, const Eigen::MatrixXd& predicted,
                         Explanation& explanation) {
  constexpr double kInstrument = 0.01, kCommon = 0.003;  // of the speed: none scatters more; many do
  const Covariate* speed = observations.find("speed_rpm");
  if (speed == nullptr || observations.from_table || speed->value.array().isNaN().any()) return;
  const Eigen::ArrayXd log_speed = speed->value.col(0).array().log() - speed->value.array().log().mean();
  for (AdoptedEffect& adopted : explanation.adopted) {
    const auto& names = adopted.term.effect->covariates;
    if (adopted.term.effect->origin == EffectOrigin::kSpeedSquared ||
        std::find(names.begin(), names.end(), "speed_rpm") == names.end())
      continue;
    const Index channel = std::max(adopted.term.rotor, 0);
    const Eigen::ArrayXd change =
        respond(adopted.term, observations, predicted).value[0].col(channel).array();
    const double exponent = ((change - change.mean()) * log_speed).sum() / log_speed.square().sum();
    const double share = -exponent / 2;  // of the readings' variance, which is scatter then
    const double scatter_rpm =
        std::sqrt(std::max(0.0, share) * (speed->value.array() - speed->value.mean()).square().mean());
    if (share <= 0 || scatter_rpm > kInstrument * speed->value.mean()) continue;
    explanation.warnings.push_back(fmt::format(
        "{}: readings of speed_rpm that scatter by {:.2g} rev/min would look the same, since they make "
        "the thrust depend less on what is read; speeds further apart would tell",
        adopted.term.label(), scatter_rpm));
    if (scatter_rpm < kCommon * speed->value.mean())
      adopted.confounded_with.emplace_back("scatter of speed_rpm");
  }
}

namespace {

/// The constant of thrusts beside their C_T, of each direction its own, by rows that scatter as they were
/// found to, and its standard error.
struct Tare {
  double value_N = 0, standard_error_N = 0;
};
Tare tare_of(const Observations& observations, const VectorXd& thrust_N, const std::vector<int>& rows) {
  const VectorXd weight = observations.scatter.of_runs(rows).cwiseInverse(),
                 slope = observations.slopes(rows, 0);
  const bool both = slope.minCoeff() < 0 && slope.maxCoeff() > 0;
  Eigen::MatrixXd columns(slope.size(), both ? 3 : 2);
  columns.col(0).setOnes();
  columns.col(1) = both ? VectorXd(slope.cwiseMax(0)) : slope;
  if (both) columns.col(2) = slope.cwiseMin(0);
  columns = weight.asDiagonal() * columns;
  const VectorXd y = weight.asDiagonal() * VectorXd(thrust_N(rows));
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(columns);
  if (qr.rank() < columns.cols()) return {};
  const VectorXd fitted = qr.solve(y);
  const double variance =
      (y - columns * fitted).squaredNorm() / static_cast<double>(y.size() - columns.cols());
  const Eigen::MatrixXd inverse = (columns.transpose() * columns).inverse();
  return {fitted(0), std::sqrt(variance * inverse(0, 0))};
}

/// Whether most rows have the value of the row before them.
bool is_shared_by_neighbours(const Covariate& covariate) {
  Index shared = 0;
  for (Index r = 1; r < covariate.value.rows(); ++r)
    if (covariate.value(r, 0) == covariate.value(r - 1, 0)) ++shared;
  return 2 * shared > covariate.value.rows() && shared + 1 < covariate.value.rows();
}

/// Days whose rows have one weather: what goes with the weather has as many independent values as there are
/// days.
void warn_of_shared_conditions(const Observations& observations, Explanation& explanation) {
  std::set<std::string> names;
  for (const AdoptedEffect& adopted : explanation.adopted)
    names.insert(adopted.term.effect->covariates.begin(), adopted.term.effect->covariates.end());
  for (const UnknownStructure& unknown : explanation.unknown) names.insert(unknown.condition);
  for (const std::string& name : names)
    if (const Covariate* covariate = observations.find(name);
        covariate != nullptr && is_shared_by_neighbours(*covariate))
      explanation.warnings.push_back(fmt::format(
          "neighbouring rows share their {}, and are taken as independent: if they belong together (a day, a "
          "set-up), give them a block (blocks = a column), or names and p may be wrong",
          name));
}

/// Correlation of two columns beside the baseline; of one rotor, or of all.
double correlation_beside(const MixedModel& baseline, const Components& a, const Components& b) {
  double ab = 0, aa = 0, bb = 0;
  for (std::size_t s = 0; s < baseline.strata().size(); ++s) {
    if (!baseline.strata()[s].means()) continue;
    Stacked both = baseline.stack(s, {&a, &b});
    baseline.project(s, 0, both);
    ab += both.col(0).dot(both.col(1));
    aa += both.col(0).squaredNorm();
    bb += both.col(1).squaredNorm();
  }
  return aa > 0 && bb > 0 ? ab / std::sqrt(aa * bb) : 0;
}

/// Conditions that no effect is known to follow: what they may do has no name to be confounded with.
std::vector<const Covariate*> without_effects(const Observations& observations,
                                              const std::vector<const Effect*>& effects) {
  std::set<std::string> named;
  for (const Effect* effect : effects) named.insert(effect->covariates.begin(), effect->covariates.end());
  std::vector<const Covariate*> result;
  for (const Covariate& covariate : observations.covariates)
    if (!covariate.derived && !covariate.per_channel() && covariate.labels.empty() &&
        covariate.value.allFinite() && !named.contains(covariate.name))
      result.push_back(&covariate);
  return result;
}

}  // namespace

void warn_of_companions(const Observations& observations, const std::vector<const Effect*>& effects,
                        Explanation& explanation) {
  constexpr double kTold = 3;        // standard errors
  constexpr double kTogether = 0.7;  // half of the one's variance is the other's
  const std::vector<const Covariate*> others = without_effects(observations, effects);
  if (others.empty()) return;
  const std::vector<int> rows = observations.all_rows();
  const MixedModel baseline = MixedModel::baseline_alone(observations, rows);
  const Forces forces = predict_forces(observations, explanation.model, rows);
  for (std::size_t t = 0; t < explanation.adopted.size(); ++t) {
    const AdoptedEffect& adopted = explanation.adopted[t];
    const ParameterEstimate& amplitude = adopted.parameters[0];
    if (adopted.term.per_group || amplitude.theory || !(amplitude.standard_error > 0)) continue;
    const Components own = respond(adopted.term, observations, forces.acted_on[t]).value;
    for (const Covariate* other : others) {
      Components column(own.size(), Eigen::MatrixXd::Zero(observations.rows(), observations.channels()));
      for (Index c = 0; c < observations.channels(); ++c)
        if (adopted.term.rotor < 0 || c == adopted.term.rotor) column[0].col(c) = other->value.col(0);
      const double together = correlation_beside(baseline, own, column);
      const double told = amplitude.value / amplitude.standard_error * std::sqrt(1 - together * together);
      if (std::abs(together) < kTogether || std::abs(told) > kTold) continue;
      explanation.warnings.push_back(
          fmt::format("{} and {} go together here (correlation {:.2f}): what {} does may be the work of {}",
                      adopted.term.label(), other->name, together, adopted.term.label(), other->name));
    }
  }
}

void warn_of_tares(const Observations& observations, const MeanModel& model, Explanation& explanation) {
  constexpr double kClear = 4;
  constexpr std::size_t kFewest = 5, kNamed = 4;
  const bool constant_beside_c_t =
      observations.coefficient && !observations.multiplicative && observations.first_own_slope() == 1;
  if (!constant_beside_c_t || observations.baseline != "constant") return;
  const std::vector<int> all = observations.all_rows();
  const Forces forces = predict_forces(observations, model, all);
  const VectorXd thrust_N = (observations.y - linearise(observations, model, forces).offset[0]).col(0);
  std::vector<std::string> tares;
  for (const auto& [group, rows] : rows_of_each(observations.group, all)) {
    if (rows.size() < kFewest) continue;
    const Tare tare = tare_of(observations, thrust_N, rows);
    if (std::abs(tare.value_N) <= kClear * tare.standard_error_N) continue;
    const std::string& name = observations.group_name[static_cast<std::size_t>(group)];
    tares.push_back(fmt::format("{}{:.3g} ± {:.2g} {}", observations.groups() > 1 ? name + " " : "",
                                tare.value_N, tare.standard_error_N, observations.unit));
  }
  if (tares.empty()) return;
  explanation.warnings.push_back(
      fmt::format("the baseline has a constant beside C_T, {}: a tare that was not taken off?",
                  first_few(tares, kNamed)));
}

std::string block_noun(const Observations& observations) {
  return observations.from_table ? "block" : "session";
}

void warn_of_single_blocks(const Observations& observations, const std::vector<OfOneBlock>& found,
                           Explanation& explanation) {
  constexpr std::size_t kNamed = 4;
  std::map<int, std::vector<std::string>> over;  // of each block
  for (const OfOneBlock& each : found) {
    const auto is_it = [&](const UnknownStructure& unknown) {
      return unknown.condition == each.covariate && unknown.rotor == each.rotor;
    };
    std::vector<std::string>& names = over[each.block];
    const bool said = std::ranges::count(names, each.label) > 0;
    if (!said && std::ranges::none_of(explanation.unknown, is_it)) names.push_back(each.label);
  }
  for (const auto& [block, names] : over) {
    if (names.empty()) continue;
    explanation.warnings.push_back(fmt::format(
        "{0} {1} alone shows that the response goes with {2}, and the others say nothing of it: a "
        "dependence is not told from whatever else was special there; the same conditions in another {0} "
        "would tell",
        block_noun(observations), observations.block_name[static_cast<std::size_t>(block)],
        first_few(names, kNamed)));
  }
}

namespace {

/// The block whose mean is farthest from the others'.
struct OddBlock {
  int block = 0;
  double away = 0, of_spread = 0;  // from the blocks' median; over what blocks of as many rows scatter by
};

OddBlock oddest_block(const Observations& observations, const VectorXd& deviation) {
  const auto blocks = places_of_each(observations.block);
  VectorXd means(std::ssize(blocks)), within = VectorXd::Zero(deviation.size());
  for (Index at = 0; const auto& [block, rows] : blocks) {
    means(at) = deviation(rows).mean();
    within(rows) = deviation(rows).array() - means(at++);
  }
  const VectorXd away = means.array() - upper_median({means.begin(), means.end()});
  const double of_blocks = sigma_by_median(away.cwiseAbs()), of_rows = sigma_by_median(within.cwiseAbs());
  OddBlock oddest;
  for (Index at = 0; const auto& [block, rows] : blocks) {
    const double spread = std::max(of_blocks, of_rows / std::sqrt(static_cast<double>(rows.size())));
    const double of_spread = spread > 0 ? std::abs(away(at)) / spread : 0;
    if (of_spread > oddest.of_spread) oddest = {block, away(at), of_spread};
    ++at;
  }
  return oddest;
}

}  // namespace

void warn_of_odd_blocks(const Observations& observations, Explanation& explanation) {
  // Of sixteen blocks that differ as normal ones do this is beyond 8 in 1 of 1,700 cases, of Student's t with
  // three degrees of freedom in 1 of 19.
  constexpr double kFar = 8;
  constexpr int kFewest = 8;
  if (observations.blocks_are_rows || observations.groups_within_blocks || observations.blocks() < kFewest)
    return;
  Eigen::MatrixXd error = -explanation.residual_after;  // measured less predicted
  if (observations.multiplicative) error = error.cwiseQuotient(observations.value);
  error = error.array().isNaN().select(0, error);
  const auto consider = [&](const VectorXd& deviation, const std::string& of_rotor) {
    const OddBlock odd = oddest_block(observations, deviation);
    if (!(odd.of_spread > kFar)) return;
    explanation.warnings.push_back(fmt::format(
        "{}{} {} is {:.3g}{} {} what the others let expect, {:.0f} times what these differ by: something was "
        "special there; leave it out to see what it hides",
        of_rotor, block_noun(observations), observations.block_name[static_cast<std::size_t>(odd.block)],
        std::abs(odd.away) * (observations.multiplicative ? 100 : 1),
        observations.multiplicative ? " %" : explanation.unit_suffix(), odd.away > 0 ? "above" : "below",
        odd.of_spread));
  };
  const VectorXd common = error.rowwise().mean();
  consider(common, "");
  for (Index c = 0; c < error.cols() && error.cols() > 2; ++c)
    consider(error.col(c) - common, fmt::format("rotor {} of ", c + 1));
}

void warn_of_alike_rows(const Observations& observations, Explanation& explanation) {
  if (!observations.blocks_are_rows) return;
  warn_of_shared_conditions(observations, explanation);
  VectorXd residual = explanation.residual_after.col(0);
  if (observations.multiplicative) residual = residual.array() / observations.value.col(0).array();
  const double correlation = row_correlation(observations, observations.all_rows(), residual);
  if (correlation == 0) return;
  explanation.warnings.push_back(fmt::format(
      "rows resemble the row before them (correlation {:.2f}) and are taken as independent: names and "
      "p may be wrong; rows that belong together want a block of their own (blocks = a column, or "
      "bins(column, n))",
      correlation));
}

}  // namespace tunnelrig
