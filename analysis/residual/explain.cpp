#include "analysis/residual/explanation.h"
#include "calibration/distributions.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <random>
#include <set>

#include <fmt/format.h>

namespace tunnelrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kFewestBlocks = 6;
constexpr std::size_t kRowsPerGross = 10;  // at most one row of ten is set aside

std::vector<int> all_rows(const Observations& observations) {
  std::vector<int> rows(static_cast<std::size_t>(observations.rows()));
  std::iota(rows.begin(), rows.end(), 0);
  return rows;
}

/// Errors of the fitted runs themselves, n × c in the unit.
MatrixXd residuals(const Observations& observations, const JointFit& fit, const std::vector<int>& rows) {
  const Components y = difference(response_components(observations), fit.linear.offset);
  return predict_held_out(observations, y, fit.linear.columns, fit.variances, rows, rows).error;
}

double rms(const MatrixXd& errors) {
  const auto missing = errors.array().isNaN();
  const Index count = errors.size() - missing.count();
  return count == 0 ? 0 : std::sqrt(missing.select(0, errors).squaredNorm() / static_cast<double>(count));
}

HeldOutErrors score(const Observations& observations, const JointFit& fit, const NullFit& variances,
                    const std::vector<int>& fit_rows, const std::vector<int>& test_rows) {
  const Components y = difference(response_components(observations), fit.linear.offset);
  return predict_held_out(observations, y, fit.linear.columns, variances, fit_rows, test_rows);
}

/// Interval of a root mean square whose blocks are resampled; Student's t for their number, on the logarithm.
void set_interval(const Observations& observations, const HeldOutErrors& errors, std::uint64_t seed,
                  ErrorEstimate& estimate) {
  std::map<int, std::pair<double, double>> blocks;  // squares, count
  for (std::size_t r = 0; r < errors.rows.size(); ++r)
    for (Index c = 0; c < errors.error.cols(); ++c) {
      const double e = errors.error(static_cast<Index>(r), c);
      if (std::isnan(e)) continue;
      auto& block = blocks[observations.block[static_cast<std::size_t>(errors.rows[r])]];
      block.first += e * e;
      block.second += 1;
    }
  estimate.held_out_rmse =
      errors.count() == 0 ? 0 : std::sqrt(errors.sum_of_squares() / static_cast<double>(errors.count()));
  estimate.held_out_low = estimate.held_out_high = estimate.held_out_rmse;
  if (blocks.size() < 2 || !(estimate.held_out_rmse > 0)) return;
  std::vector<std::pair<double, double>> list;
  for (const auto& [id, block] : blocks) list.push_back(block);
  std::mt19937_64 random(seed);
  std::uniform_int_distribution<std::size_t> pick(0, list.size() - 1);
  constexpr int kResamples = 1000;
  double sum = 0, squares = 0;
  for (int k = 0; k < kResamples; ++k) {
    double total = 0, count = 0;
    for (std::size_t b = 0; b < list.size(); ++b) {
      const auto& block = list[pick(random)];
      total += block.first;
      count += block.second;
    }
    const double value = 0.5 * std::log(total / count);
    sum += value;
    squares += value * value;
  }
  const double n = static_cast<double>(list.size());
  // The bootstrap's variance of a mean is short by (n − 1)/n.
  const double variance =
      std::max(0.0, squares / kResamples - sum * sum / kResamples / kResamples) * n / (n - 1);
  // Runs scatter within blocks too: no estimate from N errors is better than 1/(2N) of its square.
  const double least = 1 / (2.0 * static_cast<double>(errors.count()));
  const double half = student_t_quantile(0.975, std::max(n - 1, 3.0)) * std::sqrt(std::max(variance, least));
  estimate.held_out_low = estimate.held_out_rmse * std::exp(-half);
  estimate.held_out_high = estimate.held_out_rmse * std::exp(half);
}

// --- parameters
// --------------------------------------------------------------------------------------------------------

/// Jackknife over blocks: value and 95 % interval of every parameter of every term.
std::vector<std::vector<ParameterEstimate>> estimate_parameters(const Observations& observations,
                                                                const JointFit& fit,
                                                                const std::vector<int>& rows) {
  MeanModel free = fit.model;  // theory's coefficients are fitted too, to show what the data say of them
  for (Term& term : free.terms)
    if (!term.effect->theory_only) term.at_theory = false;
  const MeanModel centre = refit(observations, free, fit.variances, rows);
  std::vector<std::vector<std::vector<double>>> values(centre.terms.size());
  for (std::size_t t = 0; t < values.size(); ++t) values[t].resize(centre.terms[t].parameters.size());
  std::set<int> blocks;
  for (const int row : rows) blocks.insert(observations.block[static_cast<std::size_t>(row)]);
  const std::size_t folds = std::min<std::size_t>(blocks.size(), 24);
  std::map<int, std::size_t> fold_of;
  for (const int block : blocks) fold_of.emplace(block, fold_of.size() % folds);
  for (std::size_t fold = 0; fold < folds; ++fold) {
    std::vector<int> kept;
    for (const int row : rows)
      if (fold_of.at(observations.block[static_cast<std::size_t>(row)]) != fold) kept.push_back(row);
    const MeanModel model = refit(observations, centre, fit.variances, kept);
    for (std::size_t t = 0; t < values.size(); ++t)
      for (std::size_t k = 0; k < values[t].size(); ++k) values[t][k].push_back(model.terms[t].parameters[k]);
  }
  std::vector<std::vector<ParameterEstimate>> result(values.size());
  const double n = static_cast<double>(folds);
  for (std::size_t t = 0; t < values.size(); ++t) {
    for (std::size_t k = 0; k < values[t].size(); ++k) {
      const EffectParameter& parameter = fit.model.terms[t].effect->parameters[k];
      const double mean = std::accumulate(values[t][k].begin(), values[t][k].end(), 0.0) / n;
      double squares = 0;
      for (const double value : values[t][k]) squares += (value - mean) * (value - mean);
      const double half = student_t_quantile(0.975, n - 1) * std::sqrt((n - 1) / n * squares);
      const bool theory = k == 0 && fit.model.terms[t].at_theory;
      const double value = theory ? fit.model.terms[t].parameters[k] : centre.terms[t].parameters[k];
      const double middle = centre.terms[t].parameters[k];
      result[t].push_back({parameter.name, parameter.unit, value, middle - half, middle + half, theory});
    }
  }
  return result;
}

/// Amplitudes of each group's own: their median over the groups, and its interval.
ParameterEstimate estimate_over_groups(const Observations& observations, const Term& term,
                                       const std::vector<int>& rows) {
  Term unit = term;
  unit.per_group = false;
  unit.parameters[0] = 0;
  const MatrixXd x = respond(unit, observations, predict_response(observations, {}, rows)).derivative[0][0];
  std::map<int, std::vector<int>> groups;
  for (const int row : rows) groups[observations.group[static_cast<std::size_t>(row)]].push_back(row);
  std::vector<double> amplitudes;
  for (const auto& [group, own] : groups) {
    const VectorXd u = x(own, 0).array() - x(own, 0).mean(),
                   y = observations.y(own, 0).array() - observations.y(own, 0).mean();
    if (u.squaredNorm() > 0) amplitudes.push_back(u.dot(y) / u.squaredNorm());
  }
  const auto quantile = [&amplitudes](double p) {
    std::sort(amplitudes.begin(), amplitudes.end());
    return amplitudes[static_cast<std::size_t>(std::clamp(p, 0.0, 1.0) *
                                               static_cast<double>(amplitudes.size() - 1))];
  };
  const double half =
      1.96 / (2 * std::sqrt(static_cast<double>(amplitudes.size())));  // order statistics of a median
  const EffectParameter& parameter = term.effect->parameters[0];
  return {parameter.name, parameter.unit, quantile(0.5), quantile(0.5 - half), quantile(0.5 + half), false};
}

}  // namespace

std::string unit_of(const Observations& observations, const EffectParameter& parameter) {
  const bool volts = parameter.unit == "V" || parameter.unit.starts_with("V/");
  if (!volts || (observations.newtons_per_volt.array() != 1).any()) return parameter.unit;
  return observations.unit + parameter.unit.substr(1);
}

namespace {

// --- curves
// ------------------------------------------------------------------------------------------------------------

/// The curve over its covariate, in the response's unit, with a 95 % band.
UnknownStructure describe(const Observations& observations, const JointFit& fit, const FoundCurve& found,
                          const std::vector<int>& rows) {
  constexpr int kPoints = 25;
  UnknownStructure result{found.curve.covariate, found.curve.rotor, found.p, 0, {}};
  const Components y = difference(response_components(observations), fit.linear.offset);
  const AmplitudeFit amplitudes = fit_amplitudes(observations, y, fit.linear.columns, fit.variances, rows);
  Index first = static_cast<Index>(fit.linear.columns.size());
  for (auto curve = fit.model.curves.rbegin(); curve != fit.model.curves.rend(); ++curve) {
    first -= static_cast<Index>(curve->columns.size());
    if (curve->covariate == found.curve.covariate && curve->rotor == found.curve.rotor) break;
  }
  const Index k = static_cast<Index>(found.curve.columns.size());
  const VectorXd amplitude = amplitudes.amplitude.segment(first, k);
  const MatrixXd covariance = amplitudes.covariance.block(first, first, k, k);
  const double scale = observations.multiplicative ? observations.value.cwiseAbs().mean() : 1;
  const bool within = found.curve.x.size() == 0;
  const double low = within ? 0 : found.curve.x.minCoeff();
  const double high = within ? observations.duration_s.maxCoeff() : found.curve.x.maxCoeff();
  double mean = 0;
  for (int p = 0; p < kPoints; ++p) {
    const double u = static_cast<double>(p) / (kPoints - 1);
    VectorXd basis(k);
    for (Index b = 0; b < k; ++b) basis(b) = std::cos(std::numbers::pi * static_cast<double>(b + 1) * u);
    const double value = scale * basis.dot(amplitude),
                 half = 1.96 * scale * std::sqrt(std::max(0.0, basis.dot(covariance * basis)));
    result.shape.push_back({low + u * (high - low), value, value - half, value + half});
    mean += value / kPoints;
  }
  double lowest = 1e300, highest = -1e300;
  for (ShapePoint& point : result.shape) {
    point.y -= mean;
    point.low -= mean;
    point.high -= mean;
    lowest = std::min(lowest, point.y);
    highest = std::max(highest, point.y);
  }
  result.amplitude = (highest - lowest) / 2;
  return result;
}

/// Session scatter that no covariate explains: the sessions' offsets themselves are the shape.
UnknownStructure describe_sessions(const Observations& observations, const MatrixXd& residual,
                                   const std::vector<int>& rows) {
  UnknownStructure result{"session", -1, 0.025, 0, {}};
  std::map<int, std::vector<double>> offsets;
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const double mean = -residual.row(static_cast<Index>(r)).mean();
    if (!std::isnan(mean)) offsets[observations.block[static_cast<std::size_t>(rows[r])]].push_back(mean);
  }
  double lowest = 1e300, highest = -1e300;
  for (const auto& [block, values] : offsets) {
    const double n = static_cast<double>(values.size());
    const double mean = std::accumulate(values.begin(), values.end(), 0.0) / n;
    double squares = 0;
    for (const double value : values) squares += (value - mean) * (value - mean);
    const double half = 1.96 * std::sqrt(squares / std::max(1.0, n - 1) / n);
    result.shape.push_back({static_cast<double>(block + 1), mean, mean - half, mean + half});
    lowest = std::min(lowest, mean);
    highest = std::max(highest, mean);
  }
  result.amplitude = (highest - lowest) / 2;
  return result;
}

// --- what else is to be said
// -------------------------------------------------------------------------------------------

std::vector<Untestable> untestable_effects(const Observations& observations,
                                           const std::vector<const Effect*>& effects,
                                           const std::vector<int>& rows) {
  std::map<std::string, std::vector<Untestable>> by_name;
  std::set<std::string> testable;
  const MixedModel mixed(observations, rows, {0});
  const MatrixXd predicted = predict_response(observations, {}, rows);
  for (const Effect* effect : effects) {
    const Testability can = testability(*effect, observations);
    std::string reason = can.reason;
    if (can.ok()) {
      const std::vector<Term> ways = ways_to_try(*effect, observations, rows);
      if (ways.empty()) reason = "there are too few blocks on both sides of any step";
      bool seen = false;
      for (const Term& way : ways) {
        const TermResponse response = respond(way, observations, predicted);
        double before = 0, after = 0;
        for (std::size_t s = 0; s < mixed.strata().size(); ++s) {
          Stacked column = mixed.stack(s, {&response.derivative[0]});
          before += column.squaredNorm();
          mixed.project(s, 0, column);
          after += column.squaredNorm();
        }
        if (after > 1e-14 * before && after > 0) {
          seen = true;
          break;
        }
      }
      if (!seen && reason.empty())
        reason = "it does not vary within any location, so the location's coefficient absorbs it";
      if (seen) {
        testable.insert(effect->name);
        continue;
      }
    }
    by_name[effect->name].push_back({effect->name, reason, can.missing});
  }
  std::vector<Untestable> result;
  for (auto& [name, list] : by_name)
    if (!testable.contains(name)) result.push_back(std::move(list.front()));
  return result;
}

/// Conditions that never changed, and so keep an effect from being tested.
void warn_of_constant(const Observations& observations, Explanation& explanation) {
  std::set<std::string> constant;
  for (const Untestable& entry : explanation.untestable)
    for (const Effect& effect : all_effects())
      for (const std::string& name : effect.covariates) {
        const Covariate* covariate = observations.find(name);
        if (entry.effect == effect.name && entry.missing.empty() && covariate != nullptr &&
            !covariate->derived && covariate->value.maxCoeff() == covariate->value.minCoeff())
          constant.insert(name);
      }
  for (const std::string& name : constant)
    explanation.warnings.push_back(name + " is the same in every run: nothing can be found that follows it");
}

/// Pairs of covariates that no campaign of this design can tell apart.
void warn_of_collinear(const Observations& observations, Explanation& explanation) {
  for (std::size_t a = 0; a < observations.covariates.size(); ++a)
    for (std::size_t b = a + 1; b < observations.covariates.size(); ++b) {
      const Covariate &first = observations.covariates[a], &second = observations.covariates[b];
      if (first.derived && second.derived) continue;
      if (first.value.array().isNaN().any() || second.value.array().isNaN().any()) continue;
      const VectorXd u = first.value.col(0).array() - first.value.col(0).mean(),
                     v = second.value.col(0).array() - second.value.col(0).mean();
      if (u.norm() == 0 || v.norm() == 0) continue;
      const double correlation = u.dot(v) / u.norm() / v.norm();
      if (std::abs(correlation) < 0.999) continue;
      explanation.warnings.push_back(
          fmt::format("{} and {} go together (correlation {:.4f}): effects of the two cannot be told apart",
                      first.name, second.name, correlation));
      for (const Effect& effect : all_effects())
        for (const std::string& covariate : effect.covariates)
          if (covariate == second.name || covariate == first.name)
            explanation.untestable.push_back(
                {effect.name,
                 fmt::format("{} is collinear with {}: it is tried, but not on its own", covariate,
                             covariate == first.name ? second.name : first.name),
                 {}});
    }
  std::vector<Untestable> once;
  for (const Untestable& entry : explanation.untestable)
    if (std::none_of(once.begin(), once.end(), [&](const Untestable& u) { return u.effect == entry.effect; }))
      once.push_back(entry);
  explanation.untestable = std::move(once);
}

/// Rows whose externally studentised residual is beyond what n normal ones reach once in a hundred data sets.
/// `errors` are of the fitted rows: their variance is σ²(1 − h), where expected_std has σ²(1 + h).
std::vector<SuspectRow> suspect_rows(const Observations& observations, const HeldOutErrors& errors,
                                     const NullFit& variances, double dof) {
  std::vector<SuspectRow> result;
  const double limit = student_t_quantile(
      1 - 0.005 / static_cast<double>(std::max<Index>(1, errors.error.size())), std::max(dof - 1, 1.0));
  double sigma2 = 0;
  const double channels = static_cast<double>(observations.channels());
  for (std::size_t s = 0; s < (channels > 1 ? 2U : 1U); ++s)
    sigma2 += std::pow(variances.sigma[s], 2) * (1 + kRatios[variances.ratio[s]]) *
              (s == 0 ? 1 : channels - 1) / channels;
  for (std::size_t r = 0; r < errors.rows.size(); ++r) {
    double worst = 0;
    for (Index c = 0; c < errors.error.cols(); ++c) {
      const double unit = observations.multiplicative ? std::abs(observations.value(errors.rows[r], c)) : 1;
      const double leverage = std::pow(errors.expected_std(static_cast<Index>(r), c) / unit, 2) / sigma2 - 1;
      const double inner =
          -errors.error(static_cast<Index>(r), c) / unit / std::sqrt(sigma2 * std::max(1 - leverage, 1e-3));
      const double room = std::max(dof - inner * inner, 1e-3);
      const double outer = inner * std::sqrt(std::max(dof - 1, 1.0) / room);
      if (std::abs(outer) > std::abs(worst)) worst = outer;
    }
    if (std::abs(worst) > limit)
      result.push_back({observations.name[static_cast<std::size_t>(errors.rows[r])], worst});
  }
  std::sort(result.begin(), result.end(), [](const SuspectRow& a, const SuspectRow& b) {
    return std::abs(a.studentised) > std::abs(b.studentised);
  });
  return result;
}

double degrees_of_freedom(const Observations& observations, const JointFit& fit,
                          const std::vector<int>& rows) {
  const MixedModel mixed(observations, rows, fit.variances.ratio);
  Index dof = -static_cast<Index>(fit.linear.columns.size());
  for (std::size_t s = 0; s < mixed.strata().size(); ++s)
    if (mixed.strata()[s].means()) dof += mixed.dof(s);
  return static_cast<double>(std::max<Index>(dof, 2));
}

std::string verdict_of(const Explanation& explanation) {
  if (explanation.adopted.empty()) return explanation.unknown.empty() ? "no_structure" : "unknown";
  if (!explanation.unknown.empty()) return "partly_explained";
  const bool confounded = std::any_of(explanation.adopted.begin(), explanation.adopted.end(),
                                      [](const AdoptedEffect& a) { return !a.confounded_with.empty(); });
  return confounded ? "confounded" : "explained";
}

/// Too few blocks to find out anything: errors of the baseline, by leaving blocks out where there are two.
void explain_too_few(const Observations& observations, Explanation& explanation) {
  const std::vector<int> rows = all_rows(observations);
  const JointFit fit = fit_jointly(observations, {}, rows);
  explanation.residual_before = explanation.residual_after = residuals(observations, fit, rows);
  explanation.before.rmse = rms(explanation.residual_before);
  explanation.before.held_out_rmse = explanation.before.held_out_low = explanation.before.held_out_high =
      explanation.before.rmse;
  explanation.noise_floor = explanation.before.rmse;
  if (observations.blocks() > 1) {
    const CrossValidation validation =
        cross_validate(observations, response_components(observations), {}, fit.variances, rows);
    if (const double rmse = validation.rmse(); !std::isnan(rmse))
      explanation.before.held_out_rmse = explanation.before.held_out_low = explanation.before.held_out_high =
          rmse;
  }
  explanation.after = explanation.before;
  explanation.verdict = "insufficient";
  explanation.warnings.push_back(
      fmt::format("{} blocks are too few to tell an effect from chance; {} are needed", observations.blocks(),
                  kFewestBlocks));
}

void report_adopted(const Observations& observations, const Attribution& found, const JointFit& whole,
                    const std::vector<int>& rows, Explanation& explanation) {
  const auto parameters = estimate_parameters(observations, whole, rows);
  for (std::size_t t = 0; t < found.accepted.size(); ++t) {
    const Accepted& accepted = found.accepted[t];
    AdoptedEffect adopted{whole.model.terms[t], parameters[t], accepted.p, accepted.gain, {}, {}};
    if (adopted.term.per_group)
      adopted.parameters[0] = estimate_over_groups(observations, adopted.term, rows);
    for (std::size_t k = 0; k < adopted.parameters.size(); ++k)
      adopted.parameters[k].unit = unit_of(observations, adopted.term.effect->parameters[k]);
    for (const Ranked& rival : accepted.confounded)
      adopted.confounded_with.push_back(rival.term.effect->name);
    if (!accepted.confounded.empty())
      adopted.separating_run =
          separating_run(observations, accepted.term, accepted.confounded[0].term, found.final, rows);
    explanation.adopted.push_back(std::move(adopted));
  }
}

/// The protocol, once, on all rows.
Explanation explain_all(const Observations& observations, const std::vector<const Effect*>& effects,
                        const SearchSettings& settings) {
  Explanation explanation{.campaign = observations.campaign,
                          .response = observations.response,
                          .unit = observations.unit,
                          .baseline = observations.baseline,
                          .verdict = {},
                          .blocks = observations.blocks(),
                          .runs = static_cast<int>(observations.rows()),
                          .model = {}};
  explanation.warnings = observations.left_out;
  for (const auto& [covariate, why] : observations.not_usable)
    explanation.warnings.push_back(covariate + " is " + why);
  const std::vector<int> rows = all_rows(observations);
  explanation.untestable = untestable_effects(observations, effects, rows);
  warn_of_constant(observations, explanation);
  warn_of_collinear(observations, explanation);
  if (observations.blocks() < kFewestBlocks) {
    explain_too_few(observations, explanation);
    return explanation;
  }

  const Seal seal = seal_blocks(observations, settings.seed);
  for (const std::string& group : seal.only_sealed)
    explanation.warnings.push_back(group + " has runs in sealed blocks only: it is not scored");
  const Attribution found = attribute(observations, seal.open, effects, settings);
  explanation.rounds = found.rounds;
  explanation.curve_rounds = found.curve_rounds;
  const double scale = observations.multiplicative ? observations.value.cwiseAbs().mean() : 1;
  explanation.detectable = found.detectable_sigma * scale;

  // The seal is opened: nothing that was decided above changes any more. Curves have no name, so they are not
  // part of "after".
  JointFit named = found.final;
  if (!found.curves.empty()) {
    MeanModel terms = found.final.model;
    terms.curves.clear();
    named = found.accepted.empty() ? found.baseline : fit_jointly(found.observations, terms, seal.open);
  }
  const HeldOutErrors before = score(observations, found.baseline, named.variances, seal.open, seal.sealed);
  const Observations& wide = found.observations;
  const HeldOutErrors after = score(wide, named, named.variances, seal.open, seal.sealed);
  set_interval(observations, before, settings.seed, explanation.before);
  set_interval(observations, after, settings.seed, explanation.after);
  explanation.noise_floor =
      rms(score(wide, found.final, found.final.variances, seal.open, seal.sealed).expected_std);
  explanation.before.rmse = rms(residuals(observations, found.baseline, seal.open));
  explanation.after.rmse = rms(residuals(wide, named, seal.open));

  settings.progress("estimating parameters");
  const JointFit whole = fit_jointly(wide, found.final.model, rows);
  const JointFit whole_baseline = fit_jointly(observations, {}, rows);
  explanation.model = whole.model;
  explanation.residual_before = residuals(observations, whole_baseline, rows);
  const HeldOutErrors fitted = score(wide, whole, whole.variances, rows, rows);
  explanation.residual_after = fitted.error;
  report_adopted(wide, found, whole, rows, explanation);
  for (const FoundCurve& curve : found.curves)
    explanation.unknown.push_back(describe(wide, whole, curve, rows));
  if (found.session_unknown && found.curves.empty())
    explanation.unknown.push_back(describe_sessions(observations, fitted.error, rows));
  explanation.suspect_rows =
      suspect_rows(wide, fitted, whole.variances, degrees_of_freedom(wide, whole, rows));
  explanation.verdict = verdict_of(explanation);
  return explanation;
}

/// The worst row of a table whose rows stand for themselves, if it is beyond doubt with all that the other
/// axes can explain in the model.
std::optional<SuspectRow> gross_row(const Observations& observations) {
  constexpr double kGross = 6, kFewestLeft = 6;
  if (!observations.blocks_are_rows || observations.other_axes.empty()) return {};
  const std::vector<int> rows = all_rows(observations);
  std::vector<Components> columns;
  for (const std::string& axis : observations.other_axes) columns.push_back({observations.find(axis)->value});
  const Components y = response_components(observations);
  JointFit fit;
  fit.linear.columns = columns;
  fit.variances = CandidateScan(MixedModel(observations, rows), columns, {}).null_fit(y);
  const double dof = degrees_of_freedom(observations, fit, rows);
  if (dof < kFewestLeft) return {};
  const HeldOutErrors errors = predict_held_out(observations, y, columns, fit.variances, rows, rows);
  const std::vector<SuspectRow> suspects = suspect_rows(observations, errors, fit.variances, dof);
  if (suspects.empty() || std::abs(suspects[0].studentised) < kGross) return {};
  return suspects[0];
}

/// F + x F_other, the other axis being a column of the table.
struct OtherAxis {
  template <class T>
  T operator()(const Sample& s, const T* p, const T& force) const {
    return force + p[0] * s.x[0];
  }
};

}  // namespace

std::vector<Effect> effects_of_other_axes(const Observations& observations) {
  std::vector<Effect> effects;
  for (const std::string& axis : observations.other_axes) {
    effects.push_back(make_effect<OtherAxis>({.name = "crosstalk",
                                              .form = axis,
                                              .formula = "F + x F_other",
                                              .physics = "a load on another axis bends this one's spring",
                                              .parameters = {{"coefficient", observations.unit, -1e12, 1e12}},
                                              .covariates = {axis},
                                              .additive = true,
                                              .sign_rule = "either",
                                              .force_N = {},
                                              .jet_N = {}}));
  }
  return effects;
}

Explanation explain(const Observations& observations, const std::vector<const Effect*>& effects,
                    const SearchSettings& settings) {
  // A gross error hides what else is there: of a table's rows it is set aside, and said.
  std::vector<SuspectRow> gross;
  Observations kept = observations;
  while (gross.size() < kept.name.size() / kRowsPerGross) {
    const auto row = gross_row(kept);
    if (!row) break;
    gross.push_back(*row);
    std::vector<int> rows;
    for (int r = 0; r < static_cast<int>(kept.rows()); ++r)
      if (kept.name[static_cast<std::size_t>(r)] != row->row) rows.push_back(r);
    kept = kept.subset(rows);
  }
  Explanation explanation = explain_all(kept, effects, settings);
  explanation.suspect_rows.insert(explanation.suspect_rows.begin(), gross.begin(), gross.end());
  return explanation;
}

}  // namespace tunnelrig
