// The next run: where two explanations that agree so far would disagree most.
#include "analysis/residual/explanation/explanation.h"
#include "analysis/upper_median.h"

#include <algorithm>
#include <cmath>
#include <set>

#include <fmt/format.h>

namespace tunnelrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kBeyond = 0.5;                    // of a condition's range, on either side of what was seen
constexpr double kSlowest = 0.6, kFastest = 1.15;  // of the usual speed
constexpr std::size_t kMostConditions = 5;
constexpr double kTold = 3,
                 kMostPairs = 100;  // a difference of so many σ tells; nobody makes more pairs of runs

/// A run that could be made: a place, and what differs there from an ordinary run.
struct Setting {
  std::map<std::string, double> covariates;
  std::string location;
  int like = 0;  // a run to take everything else from
  bool in_tunnel = true;
};

double median(const VectorXd& values) { return upper_median({values.begin(), values.end()}); }

/// What a laboratory can set, a little beyond what was seen: where all was positive no less than half of the
/// least, since logarithms and powers have no end towards zero.
std::pair<double, double> reach(const Covariate& covariate) {
  const VectorXd values = covariate.value.col(0);
  if (covariate.name == "speed_rpm") return {kSlowest * median(values), kFastest * median(values)};
  const double low = values.minCoeff(), high = values.maxCoeff(), range = high - low;
  double least = low - kBeyond * range;
  if (low >= 0) least = std::max(least, low / 2);
  double most = high + kBeyond * range;
  if (covariate.name == "relative_humidity") most = std::min(most, 1.0);
  return {least, most};
}

/// Conditions of either effect, and the speed: thrust tells what adds a force from what scales it.
std::vector<const Covariate*> conditions_of(const Observations& observations, const Term& first,
                                            const Term& second) {
  std::set<std::string> names = {"speed_rpm"};
  for (const Term* term : {&first, &second})
    names.insert(term->effect->covariates.begin(), term->effect->covariates.end());
  std::vector<const Covariate*> result;
  for (const std::string& name : names) {
    const Covariate* covariate = observations.find(name);
    const bool can_be_set = covariate != nullptr && !covariate->derived && !covariate->per_channel() &&
                            name != "run_order";  // what comes next has the next number
    if (can_be_set && !covariate->value.array().isNaN().any()) result.push_back(covariate);
  }
  if (result.size() > kMostConditions) result.resize(kMostConditions);
  return result;
}

/// An ordinary run at every location, and in open space where the campaign is in a tunnel.
std::vector<Setting> ordinary_runs(const Observations& observations,
                                   const std::vector<const Covariate*>& conditions) {
  std::vector<Setting> settings;
  std::set<int> groups;
  for (int row = 0; row < static_cast<int>(observations.rows()); ++row) {
    const int group = observations.group[static_cast<std::size_t>(row)];
    if (groups.insert(group).second)
      settings.push_back({{},
                          observations.group_name[static_cast<std::size_t>(group)],
                          row,
                          observations.in_tunnel[static_cast<std::size_t>(row)]});
  }
  const bool all_in_tunnel =
      std::all_of(settings.begin(), settings.end(), [](const Setting& s) { return s.in_tunnel; });
  if (all_in_tunnel && observations.in_tunnel[0]) settings.push_back({{}, "OS", 0, false});
  for (Setting& setting : settings)
    for (const Covariate* condition : conditions)
      setting.covariates[condition->name] = median(condition->value.col(0));
  return settings;
}

/// Every combination of low, usual and high of the conditions.
std::vector<Setting> variations(const Setting& ordinary, const std::vector<const Covariate*>& conditions) {
  std::vector<Setting> settings = {ordinary};
  for (const Covariate* condition : conditions) {
    const auto [least, most] = reach(*condition);
    std::vector<Setting> more;
    for (const Setting& setting : settings)
      for (const double value : {setting.covariates.at(condition->name), least, most}) {
        more.push_back(setting);
        more.back().covariates[condition->name] = value;
      }
    settings = std::move(more);
  }
  return settings;
}

/// Observations whose runs are the settings; steps that came before the campaign's end have happened.
Observations imagined(const Observations& observations, const std::vector<Setting>& settings) {
  std::vector<int> rows;
  for (const Setting& setting : settings) rows.push_back(setting.like);
  Observations result = observations.subset(rows);
  result.duration_s.setZero();
  result.shape.clear();
  result.previous.assign(rows.size(), -1);
  result.position =
      VectorXd::Constant(static_cast<Index>(rows.size()), static_cast<double>(observations.rows()));
  result.in_tunnel.clear();
  for (const Setting& setting : settings) result.in_tunnel.push_back(setting.in_tunnel);
  for (Covariate& covariate : result.covariates) {
    if (covariate.name == "run_order") covariate.at_zero.setConstant(result.position(0));
    for (std::size_t s = 0; s < settings.size(); ++s)
      if (const auto set = settings[s].covariates.find(covariate.name); set != settings[s].covariates.end())
        covariate.value.row(static_cast<Index>(s)).setConstant(set->second);
  }
  return result;
}

/// Forces there: those of the run that the setting is like, at its speed.
MatrixXd forces_at(const Observations& observations, const MatrixXd& predicted,
                   const std::vector<Setting>& settings) {
  MatrixXd result(static_cast<Index>(settings.size()), predicted.cols());
  const Covariate* speed = observations.find("speed_rpm");
  for (std::size_t s = 0; s < settings.size(); ++s) {
    result.row(static_cast<Index>(s)) = predicted.row(settings[s].like);
    const auto set = settings[s].covariates.find("speed_rpm");
    if (speed != nullptr && set != settings[s].covariates.end())
      result.row(static_cast<Index>(s)) *= std::pow(set->second / median(speed->value.col(0)), 2);
  }
  return result;
}

/// Difference of the two effects' predictions, every setting against the ordinary run before it, in σ of such
/// a pair; 0 where either turns the sign of a response that has had only one.
VectorXd distances(const Observations& observations, const JointFit& fit, std::size_t t, const Term& rival,
                   const std::vector<Setting>& settings, const std::vector<std::size_t>& ordinary,
                   const std::vector<int>& rows) {
  const Observations at = imagined(observations, settings);
  const MatrixXd forces =
      forces_at(observations, predict_forces(observations, fit.model, rows).acted_on[t], settings);
  const MatrixXd by_own = respond(fit.model.terms[t], at, forces).value[0],
                 by_rival = respond(rival, at, forces).value[0];
  MatrixXd difference = by_own - by_rival;
  const MatrixXd usual = difference(std::vector<Index>(ordinary.begin(), ordinary.end()), Eigen::all);
  difference -= usual;
  const MixedModel mixed = MixedModel::baseline_alone(observations, rows);
  const MatrixXd by_mode = difference * mixed.mode_matrix();
  std::vector<int> like;
  for (const Setting& setting : settings) like.push_back(setting.like);
  const Eigen::ArrayXd scatter = observations.scatter.of_runs(like);
  VectorXd squares = VectorXd::Zero(by_mode.rows());
  for (std::size_t k = 0; k < mixed.strata().size(); ++k) {
    const MixedModel::Stratum& stratum = mixed.strata()[k];
    if (!stratum.means()) continue;
    const double variance = 2 * std::max(std::pow(fit.variances.sigma[k], 2), 1e-300);
    squares += by_mode.middleCols(stratum.first_mode, stratum.modes).rowwise().squaredNorm() / variance;
  }
  const bool one_sign = (observations.value.array() > 0).all() || (observations.value.array() < 0).all();
  if (one_sign && !observations.multiplicative)
    for (Index s = 0; s < squares.size(); ++s)
      for (const MatrixXd* made : {&by_own, &by_rival})
        if ((forces.row(s).array() * (forces.row(s) + made->row(s)).array() <= 0).any()) squares(s) = 0;
  return squares.array().sqrt() / scatter;
}

std::string in_words(const SeparatingRun& run, const Observations& observations) {
  std::string text = run.location.empty() ? "a run" : "a run at " + run.location;
  for (const auto& [name, value] : run.setting) {
    const Covariate* covariate = observations.find(name);
    const std::string unit = covariate == nullptr || covariate->unit == "1" ? "" : covariate->unit;
    text += fmt::format(", {} = {:.4g}{}{}", name, value, unit.empty() ? "" : " ", unit);
  }
  text +=
      fmt::format(", beside an ordinary one there: the predictions differ by {:.1f} σ", run.expected_sigma);
  const double pairs = std::ceil(std::pow(kTold / run.expected_sigma, 2));
  return pairs > 1 ? text + fmt::format(", so {:.0f} such pairs tell at {:.0f} σ", pairs, kTold) : text;
}

}  // namespace

std::optional<SeparatingRun> separating_run(const Observations& observations, const JointFit& fit,
                                            std::size_t t, const Term& rival, const std::vector<int>& rows) {
  const std::vector<const Covariate*> conditions = conditions_of(observations, fit.model.terms[t], rival);
  if (conditions.empty()) return {};
  std::vector<Setting> settings;
  std::vector<std::size_t> ordinary;  // the setting that each is compared with
  for (const Setting& usual : ordinary_runs(observations, conditions)) {
    const std::size_t at = settings.size();
    for (Setting& setting : variations(usual, conditions)) settings.push_back(std::move(setting));
    ordinary.resize(settings.size(), at);
  }
  const VectorXd distance = distances(observations, fit, t, rival, settings, ordinary, rows);
  SeparatingRun best;
  for (std::size_t s = 0; s < settings.size(); ++s) {
    const double sigma = distance(static_cast<Index>(s));
    // Fewer conditions to set are worth a little distance: later combinations must be clearly better.
    if (!std::isfinite(sigma) || sigma <= 1.05 * best.expected_sigma) continue;
    best.expected_sigma = sigma;
    best.location = settings[s].location;
    best.setting.clear();
    for (const auto& [name, value] : settings[s].covariates)
      if (value != settings[ordinary[s]].covariates.at(name)) best.setting[name] = value;
  }
  if (!(best.expected_sigma >= kTold / std::sqrt(kMostPairs))) return {};
  best.text = in_words(best, observations);
  return best;
}

}  // namespace tunnelrig
