// What a candidate beyond chance must not be, to get its name.
#include "analysis/residual/likelihood/testability.h"
#include "analysis/residual/search/group_amplitudes.h"
#include "analysis/residual/search/search.h"
#include "analysis/residual/search/step_profile.h"

#include <algorithm>
#include <cmath>

namespace tunnelrig {

using Eigen::Index;

/// The baseline of a campaign has the nominal speed, and a table's law over a throttle none, so what the
/// measured speed does begins with its square. A weaker dependence without it is a reading that scatters, or
/// something else.
bool Search::lacks_speed_squared(const Term& term) const {
  const auto& covariates = term.effect->covariates;
  const bool of_speed = std::find(covariates.begin(), covariates.end(), "speed_rpm") != covariates.end();
  const auto is_square = [](const Term& way) { return way.effect->origin == EffectOrigin::kSpeedSquared; };
  const bool has_none = !data_.observations().from_table || std::ranges::any_of(data_.ways(), is_square);
  return has_none && of_speed && !is_square(term) &&
         std::none_of(found_.accepted.begin(), found_.accepted.end(),
                      [&](const Accepted& accepted) { return is_square(accepted.term); });
}

std::optional<std::string> Search::only_bends(const Term& term, const NullFit& variances,
                                              const CrossValidation& with_term) const {
  // A law that the baseline has, of a condition that is no load of a cell, may bend as well as the cell.
  const bool of_law = term.effect->of_force_alone() && !data_.observations().baseline_over.empty() &&
                      !data_.observations().line_of_cell;
  for (const Curve& curve : data_.curves_to_try()) {
    const auto shares = [&](const Accepted& other) {
      return is_over(curve, own_conditions(*other.term.effect, data_.observations())) &&
             (other.term.rotor < 0 || other.term.rotor == term.rotor);
    };
    if (!is_bend_over(curve, own_conditions(*term.effect, data_.observations()), term.rotor) ||
        (!of_law && std::ranges::none_of(found_.accepted, shares)))
      continue;
    const CrossValidation with_bend =
        unseen_with(columns_with({without_trend(curve, data_.rows()).columns[0]}), variances);
    if (!compare(with_bend, with_term).told_apart()) return curve.covariate;
  }
  return {};
}

const Term* Search::cancelled_by_newest(const JointFit& fit) const {
  constexpr double kSmallPart = 1.0 / 3;
  const Term& newest = fit.model.terms.back();
  const Eigen::MatrixXd predicted = predict_response(data_.observations(), fit.model, data_.rows());
  const auto made_by = [&](const Term& term) {
    return respond(term, data_.observations(), predicted).value[0];
  };
  const Eigen::MatrixXd of_newest = made_by(newest);
  for (const Term& other : fit.model.terms) {
    if (&other == &newest || other.per_group || other.rotor != newest.rotor ||
        !share_a_condition(*newest.effect, *other.effect, data_.observations()))
      continue;
    const Eigen::MatrixXd older = made_by(other);
    if (rms_beside_baseline(data_, of_newest + older) <
        kSmallPart * std::min(rms_beside_baseline(data_, of_newest), rms_beside_baseline(data_, older)))
      return &other;
  }
  return nullptr;
}

bool Search::is_gradual(const std::vector<Term>& steps, const NullFit& variances,
                        const CrossValidation& with_steps) const {
  const Eigen::MatrixXd predicted = predict_response(data_.observations(), found_.fit.model, data_.rows());
  std::vector<Components> always;  // of each step, as if it had been from the first run on
  for (Term step : steps) {
    step.parameters[step.effect->change_point().value()] = 0;
    always.push_back(respond(step, data_.observations(), predicted).derivative[0]);
  }
  std::vector<Components> columns = found_.fit.linear.columns;
  const double half = static_cast<double>(data_.observations().rows() - 1) / 2;
  for (const int power : {1, 2, 3}) {
    for (const Components& after : always) {
      columns.push_back(after);
      for (Eigen::MatrixXd& component : columns.back())
        for (Index row = 0; row < component.rows(); ++row)
          component.row(row) *= std::pow(static_cast<double>(row) / half - 1, power);
    }
    if (compare(unseen_with(columns, variances), with_steps).mean <= 0) return true;
  }
  // That the line or power law of the baseline holds all along is an assumption (a wing stalls).
  return std::ranges::any_of(data_.curves_to_try(), [&](const Curve& curve) {
    if (data_.observations().baseline_over.empty() || !is_over(curve, {data_.observations().baseline_over}) ||
        curve.strength || curve.rotor >= 0)
      return false;
    return !compare(unseen_with(columns_with(curve.columns), variances), with_steps).told_apart();
  });
}

JointFit Search::at_best_run(JointFit fit, std::size_t from_newest) {
  const std::size_t t = fit.model.terms.size() - from_newest;
  const Term& step = fit.model.terms[t];
  if (!step.effect->has_change_point()) return fit;
  const StepProfile profile = step_profile(data_.observations(), fit.model, t, data_.rows());
  if (profile.empty() || profile.likeliest() == first_row_of(step)) return fit;
  if (step.per_group) {
    Observations moved = data_.observations();
    JointFit there = fit_with_parameter(step.effect->change_point().value(), profile.likeliest(), moved,
                                        fit.model, t, data_.rows());
    if (likelihood_beside_own(moved, there.variances, data_.rows()) <=
        likelihood_beside_own(data_.observations(), fit.variances, data_.rows()))
      return fit;
    data_.set_observations(std::move(moved));
    return there;
  }
  MeanModel moved = fit.model;
  moved.terms[t].parameters[step.effect->change_point().value()] = profile.likeliest();
  JointFit there = fit_jointly(data_.observations(), moved, data_.rows());
  return there.variances.log_likelihood > fit.variances.log_likelihood ? there : fit;
}

void Search::place_steps() {
  for (std::size_t k = 1; k <= found_.fit.model.terms.size(); ++k) found_.set_fit(at_best_run(found_.fit, k));
}

}  // namespace tunnelrig
