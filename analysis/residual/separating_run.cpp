// The next run: where two explanations that agree so far would disagree most.
#include "analysis/residual/explanation.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include <fmt/format.h>

namespace tunnelrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kBeyond = 0.5;  // of a condition's range, on either side of what was seen

struct Setting {
  std::map<std::string, double> covariates;
  int row = 0;  // the run that it is a variation of
};

double median(VectorXd values) {
  std::nth_element(values.data(), values.data() + values.size() / 2, values.data() + values.size());
  return values(values.size() / 2);
}

/// What a laboratory can set, a little beyond what was seen; never below zero where zero is a limit.
std::pair<double, double> reach(const Covariate& covariate) {
  const double low = covariate.value.minCoeff(), high = covariate.value.maxCoeff(), range = high - low;
  double least = low - kBeyond * range;
  if (low >= 0) least = std::max(least, 0.0);
  double most = high + kBeyond * range;
  if (covariate.name == "relative_humidity") most = std::min(most, 1.0);
  return {least, most};
}

std::vector<const Covariate*> conditions_of(const Observations& observations, const Term& first,
                                            const Term& second) {
  std::set<std::string> names;
  for (const Term* term : {&first, &second})
    names.insert(term->effect->covariates.begin(), term->effect->covariates.end());
  std::vector<const Covariate*> result;
  for (const std::string& name : names)
    if (const Covariate* covariate = observations.find(name); covariate != nullptr && name != "run_order")
      result.push_back(covariate);
  return result;
}

/// Every combination of low, median and high of the conditions that the two effects depend on, at a run of
/// each group that differs in the sign of what came before it.
std::vector<Setting> reachable(const Observations& observations,
                               const std::vector<const Covariate*>& conditions,
                               const std::vector<int>& rows) {
  std::vector<Setting> settings;
  std::set<int> groups;
  for (const int row : rows)
    if (groups.insert(observations.group[static_cast<std::size_t>(row)]).second)
      settings.push_back({{}, row});
  for (const Covariate* condition : conditions) {
    const auto [least, most] = reach(*condition);
    const double middle = median(condition->value.col(0));
    std::vector<Setting> more;
    for (const Setting& setting : settings)
      for (const double value : {least, middle, most}) {
        more.push_back(setting);
        more.back().covariates[condition->name] = value;
      }
    settings = std::move(more);
  }
  return settings;
}

/// Observations whose runs are the settings: each its template with other conditions.
Observations imagined(const Observations& observations, const std::vector<Setting>& settings) {
  Observations result = observations;
  std::vector<int> rows;
  for (const Setting& setting : settings) rows.push_back(setting.row);
  const auto pick = [&](auto& values) {
    auto copy = values;
    copy.clear();
    for (const int row : rows) copy.push_back(values[static_cast<std::size_t>(row)]);
    values = copy;
  };
  result.y = MatrixXd(observations.y(rows, Eigen::all));
  result.value = MatrixXd(observations.value(rows, Eigen::all));
  result.known = MatrixXd(observations.known(rows, Eigen::all));
  result.duration_s = VectorXd(observations.duration_s(rows));
  result.shape.clear();
  pick(result.group);
  pick(result.block);
  pick(result.in_tunnel);
  result.previous.assign(rows.size(), -1);
  for (Covariate& covariate : result.covariates) {
    covariate.value = MatrixXd(covariate.value(rows, Eigen::all));
    for (std::size_t s = 0; s < settings.size(); ++s)
      if (const auto set = settings[s].covariates.find(covariate.name); set != settings[s].covariates.end())
        covariate.value.row(static_cast<Index>(s)).setConstant(set->second);
  }
  return result;
}

/// What a term adds, less what the group's constant would take of it.
MatrixXd beyond_the_constant(const Observations& observations, const Observations& at, const Term& term,
                             const MatrixXd& predicted, const MatrixXd& predicted_at,
                             const std::vector<int>& rows) {
  // The settings' medians differ from the campaign's: the reference is the campaign's, which a constant makes
  // good.
  const MatrixXd seen = respond(term, observations, predicted).value[0];
  MatrixXd result = respond(term, at, predicted_at).value[0];
  for (Index s = 0; s < result.rows(); ++s) {
    Eigen::RowVectorXd mean = Eigen::RowVectorXd::Zero(result.cols());
    double count = 0;
    for (const int row : rows) {
      if (observations.group[static_cast<std::size_t>(row)] != at.group[static_cast<std::size_t>(s)])
        continue;
      mean += seen.row(row);
      ++count;
    }
    if (count > 0) result.row(s) -= mean / count;
  }
  return result;
}

std::string in_words(const Setting& setting, const std::string& location, double sigma) {
  std::string text = "a run at " + location;
  for (const auto& [name, value] : setting.covariates) text += fmt::format(", {} = {:.4g}", name, value);
  return text + fmt::format(": the two predictions differ by {:.1f} σ of one run", sigma);
}

}  // namespace

std::optional<SeparatingRun> separating_run(const Observations& observations, const Term& first,
                                            const Term& second, const JointFit& fit,
                                            const std::vector<int>& rows) {
  const std::vector<const Covariate*> conditions = conditions_of(observations, first, second);
  if (conditions.empty() || conditions.size() > 5) return {};
  const std::vector<Setting> settings = reachable(observations, conditions, rows);
  Observations at = imagined(observations, settings);
  const MatrixXd predicted = predict_response(observations, fit.model, rows);
  std::vector<int> templates;
  for (const Setting& setting : settings) templates.push_back(setting.row);
  const MatrixXd predicted_at = predicted(templates, Eigen::all);
  const MatrixXd difference = beyond_the_constant(observations, at, first, predicted, predicted_at, rows) -
                              beyond_the_constant(observations, at, second, predicted, predicted_at, rows);
  const MixedModel mixed(observations, rows, {0});
  const MatrixXd by_mode = difference * mixed.mode_matrix();
  SeparatingRun best;
  std::size_t chosen = 0;
  for (Index s = 0; s < by_mode.rows(); ++s) {
    double distance2 = 0;
    for (std::size_t k = 0; k < mixed.strata().size(); ++k) {
      const MixedModel::Stratum& stratum = mixed.strata()[k];
      if (!stratum.means()) continue;
      const double variance = std::pow(fit.variances.sigma[k], 2) * (1 + kRatios[fit.variances.ratio[k]]);
      distance2 += by_mode.row(s).segment(stratum.first_mode, stratum.modes).squaredNorm() /
                   std::max(variance, 1e-300);
    }
    if (!std::isfinite(distance2) || std::sqrt(distance2) <= best.expected_sigma) continue;
    best.expected_sigma = std::sqrt(distance2);
    chosen = static_cast<std::size_t>(s);
  }
  if (!(best.expected_sigma > 0)) return {};
  best.setting = settings[chosen].covariates;
  best.location = observations.group_name[static_cast<std::size_t>(
      observations.group[static_cast<std::size_t>(settings[chosen].row)])];
  best.text = in_words(settings[chosen], best.location, best.expected_sigma);
  return best;
}

}  // namespace tunnelrig
