#include "analysis/model/adopt.h"

#include "analysis/residual/explanation/explanation_output.h"
#include "analysis/residual/likelihood/cross_validation.h"
#include "datasets/error.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace tunnelrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

ModelTerm model_term(const AdoptedEffect& adopted, const Observations& observations) {
  ModelTerm term{.effect = adopted.term.effect,
                 .rotor = adopted.term.rotor,
                 .other = adopted.term.other,
                 .at_theory = adopted.term.at_theory,
                 .reference = reference_of(*adopted.term.effect, observations)};
  for (std::size_t k = 0; k < adopted.parameters.size(); ++k) {
    term.parameters.push_back(adopted.parameters[k].value);
    term.units.push_back(adopted.parameters[k].unit);
    if (!adopted.parameters[k].run.empty()) term.first_run = adopted.parameters[k].run;
  }
  return term;
}

ModelCurve model_curve(const Curve& curve, const VectorXd& amplitude, const Observations& observations) {
  ModelCurve result{.covariate = curve.covariate,
                    .rotor = curve.rotor,
                    .shape = curve.shape,
                    .low = curve.low,
                    .high = curve.high,
                    .coefficients = {amplitude.data(), amplitude.data() + amplitude.size()},
                    .tilt = curve.tilt,
                    .levels = curve.levels,
                    .labels = curve.labels,
                    .place = curve.in_place()};
  // The mean over the runs is the baseline's: without it the curve would shift every coefficient.
  const Covariate& covariate = *observations.find(curve.covariate);
  const Index rotor = std::max(curve.rotor, 0);
  result.centre.assign(result.coefficients.size(), 0);
  for (std::size_t k = 0; k < result.centre.size(); ++k) {
    double sum = 0;
    for (Index row = 0; row < observations.rows(); ++row) sum += result.column(k, covariate.at(row, rotor));
    result.centre[k] = sum / static_cast<double>(observations.rows());
  }
  if (curve.strength) result.times = {curve.times(), *curve.strength, curve.columns[0][0].col(0).mean()};
  return result;
}

/// Of the jackknife; of curves alone as many as it would have had.
double jackknife_dof(const Observations& observations, const Explanation& explanation) {
  std::size_t folds = std::min(static_cast<std::size_t>(observations.blocks()), kMostFolds);
  for (const AdoptedEffect& adopted : explanation.adopted)
    for (const ParameterEstimate& parameter : adopted.parameters)
      if (!parameter.deviations.empty()) folds = std::min(folds, parameter.deviations.size());
  return std::max(1.0, static_cast<double>(folds) - 1);
}

/// Where a parameter of the model stands among the joint fit's columns, if it does, and how far it is known.
struct Placed {
  std::optional<Index> column;
  double uncertainty;
  std::size_t term;                // whose it is; of a curve, which has no deviations, nothing
  std::vector<double> deviations;  // of the jackknife
};

/// How two go together: those of one effect (an amplitude and its time constant lie on a ridge that is no
/// ellipse) as the jackknife's folds do, others as their columns do.
double covariance_of_two(const Placed& one, const Placed& two, const MatrixXd& columns) {
  if (one.uncertainty == 0 || two.uncertainty == 0) return 0;
  if (one.term == two.term && !one.deviations.empty() && one.deviations.size() == two.deviations.size())
    return std::inner_product(one.deviations.begin(), one.deviations.end(), two.deviations.begin(), 0.0);
  if (!one.column || !two.column) return 0;
  const Index i = *one.column, j = *two.column;
  const double correlation = columns(i, j) / std::sqrt(columns(i, i) * columns(j, j));
  if (!std::isfinite(correlation)) return 0;
  return one.uncertainty * two.uncertainty * std::clamp(correlation, -1.0, 1.0);
}

MatrixXd covariance_of(const std::vector<Placed>& placed, const MatrixXd& columns) {
  const auto size = static_cast<Index>(placed.size());
  MatrixXd covariance = MatrixXd::Zero(size, size);
  for (Index i = 0; i < size; ++i)
    for (Index j = 0; j < size; ++j) {
      const Placed &one = placed[static_cast<std::size_t>(i)], &two = placed[static_cast<std::size_t>(j)];
      covariance(i, j) = i == j ? one.uncertainty * one.uncertainty : covariance_of_two(one, two, columns);
    }
  return covariance;
}

/// Curves of runs' means stand where the model has a column of values for them.
bool acts_on_means(const Curve& curve) { return curve.x.size() > 0; }

}  // namespace

bool adoptable(const Observations& observations) {
  return observations.response == "thrust" &&
         (observations.baseline == "thesis" || observations.baseline == "open_space");
}

void require_adoptable(const Observations& observations) {
  if (!adoptable(observations))
    throw InputError(fmt::format(
        "--adopt: a model corrects the thrusts of a campaign, and this explains {} of {}; without it "
        "the errors are the same, with --adopt-empirical those with the curves",
        observations.response, observations.campaign.empty() ? "a table" : observations.campaign));
  // What all rotors have in common is of this one as well.
  if (!observations.unmeasured.empty())
    throw InputError("--adopt: " + observations.unmeasured.front() + "; a model would make a thrust of it");
}

Adoption adopt(const Observations& observations, const Explanation& explanation, bool empirical) {
  require_adoptable(observations);
  Adoption result;
  ModelVersion model{.baseline = observations.baseline,
                     .multiplicative = observations.multiplicative,
                     .dof = jackknife_dof(observations, explanation),
                     .explanation = explanation_json(explanation)};
  const bool curves_wanted = empirical && !explanation.model.curves.empty();
  for (const Curve& curve : explanation.by_sealed_too)
    result.notes.push_back(
        fmt::format("the curve over {} is not adopted: it took the sealed blocks to see it, and none are "
                    "left to score it by",
                    curve.label()));
  if (explanation.adopted.empty() && !curves_wanted) {
    if (std::ranges::any_of(explanation.unknown, &UnknownStructure::is_curve_of_model))
      result.notes.emplace_back("what was found has no name; --adopt-empirical adopts it as a curve");
    return result;
  }
  const std::vector<int> rows = observations.all_rows();
  const JointFit joint = fit_jointly(observations, explanation.model, rows);
  const LinearModel& linear = joint.linear;
  const AmplitudeFit fit =
      fit_amplitudes(observations, difference(response_components(observations), linear.offset),
                     linear.columns, joint.variances, rows);
  std::vector<Placed> placed;
  for (const AdoptedEffect& adopted : explanation.adopted) {
    model.terms.push_back(model_term(adopted, observations));
    for (std::size_t k = 0; k < adopted.parameters.size(); ++k) {
      const std::optional<Index> column = linear.column_of({model.terms.size() - 1, k});
      const bool uncertain = column || adopted.term.effect->parameters[k].role == ParameterRole::kShape;
      placed.push_back({column, uncertain ? adopted.parameters[k].standard_error : 0, model.terms.size(),
                        adopted.parameters[k].deviations});
    }
    if (!adopted.confounded_with.empty())
      result.notes.push_back(fmt::format("{} is adopted, and these data cannot tell it from {}",
                                         adopted.term.label(), fmt::join(adopted.confounded_with, ", ")));
  }
  Index column = std::ssize(linear.of_parameters);
  for (const Curve& curve : explanation.model.curves) {
    const auto bends = static_cast<Index>(curve.columns.size());
    if (curves_wanted && acts_on_means(curve)) {
      model.curves.push_back(model_curve(curve, fit.amplitude.segment(column, bends), observations));
      for (Index k = column; k < column + bends; ++k) {
        placed.push_back({k, std::sqrt(std::max(0.0, fit.covariance(k, k))), 0, {}});
      }
    } else {
      result.notes.push_back(fmt::format("the curve over {} is not adopted{}", curve.label(),
                                         acts_on_means(curve) ? "; --adopt-empirical does that"
                                                              : ": it leaves the runs' means as they are"));
    }
    column += bends;
  }
  if (model.terms.empty() && model.curves.empty()) return result;
  model.covariance = covariance_of(placed, fit.covariance);
  result.model = std::move(model);
  return result;
}

}  // namespace tunnelrig
