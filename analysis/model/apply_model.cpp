#include "analysis/model/apply_model.h"

#include "analysis/residual/likelihood/joint_fit.h"
#include "analysis/residual/observations/previous_run.h"
#include "datasets/error.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>

namespace tunnelrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kMostInversions = 200;
constexpr double kConverged = 1e-12;  // relative change of the last step; the promise is 1e-10
constexpr double kDifference = 1e-4;  // of derivatives by parameters, in standard uncertainties or relative
constexpr double kReadingStep = 1e-6;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// T = e(F) for all rotors of a run at once, and back.
class Forward {
 public:
  Forward(const ModelVersion& model, const Observations& observations)
      : model_(model), observations_(observations) {
    Index next = 0;
    std::vector<int> stages;
    for (const ModelTerm& term : model.terms) {
      stages.push_back(term.effect->stage());
      first_.push_back(next);
      next += static_cast<Index>(term.parameters.size());
      term_covariates_.emplace_back();
      for (const std::string& name : term.effect->covariates)
        term_covariates_.back().push_back(observations.find(name));
    }
    order_ = order_of_action(stages);
    for (const ModelCurve& curve : model.curves) {
      first_curve_.push_back(next);
      next += static_cast<Index>(curve.coefficients.size());
      curve_covariates_.push_back(observations.find(curve.covariate));
      curve_places_.push_back(observations.find_place(curve.place));
      curve_times_.push_back(curve.times ? observations.find(curve.times->covariate) : nullptr);
    }
    predict_forces();
  }
  Forward(const Forward&) = delete;  // the run before is of this one's predicted forces
  Forward& operator=(const Forward&) = delete;

  /// The covariate that the run lacks; empty where it has all.
  std::string lacks(Index row) const {
    const auto missing = [&](const Covariate* covariate, int rotor) {
      if (covariate == nullptr) return true;
      for (Index c = 0; c < observations_.channels(); ++c)
        if ((rotor < 0 || c == rotor) && std::isnan(covariate->at(row, c))) return true;
      return false;
    };
    for (std::size_t t = 0; t < model_.terms.size(); ++t) {
      const ModelTerm& term = model_.terms[t];
      if (term.effect->tunnel_only && !in_tunnel(row)) continue;
      for (std::size_t k = 0; k < term_covariates_[t].size(); ++k) {
        const std::string& name = term.effect->covariates[k];
        if (!may_be_absent(name) && missing(term_covariates_[t][k], term.rotor))
          return fmt::format("it has no {}, which the adopted effect {} needs", name, term.label());
      }
    }
    for (std::size_t k = 0; k < model_.curves.size(); ++k) {
      const ModelCurve& curve = model_.curves[k];
      if (missing(curve_covariates_[k], curve.rotor))
        return fmt::format("it has no {}, which the adopted {} needs", curve.covariate, curve.label());
      if (curve.times && missing(curve_times_[k], curve.rotor))
        return fmt::format("it has no {}, which the adopted {} needs", curve.times->covariate, curve.label());
      if (curve.shape == CurveShape::kLevels && !is_level(k, row))
        return fmt::format("its {} is none that the adopted {} knows", curve.covariate, curve.label());
    }
    return "";
  }

  /// What the cells would read of forces F.
  VectorXd reading(Index row, const VectorXd& force_N, const VectorXd& parameters) const {
    VectorXd result =
        model_.multiplicative ? multiplied(row, force_N, parameters) : added_to(row, force_N, parameters);
    for (Index c = 0; c < force_N.size(); ++c) {
      const double curves = curve_sum(row, c, parameters);
      model_.multiplicative ? result(c) *= std::exp(curves) : result(c) += curves * air(row, c);
    }
    return result;
  }

  /// The forces that read `reading_N`; nothing where the steps do not settle.
  std::optional<VectorXd> forces(Index row, const VectorXd& reading_N, const VectorXd& parameters) const {
    VectorXd force_N = reading_N;
    for (int step = 0; step < kMostInversions; ++step) {
      const VectorXd read_N = reading(row, force_N, parameters);
      const VectorXd next = model_.multiplicative
                                ? VectorXd(force_N.array() * reading_N.array() / read_N.array())
                                : VectorXd(force_N + reading_N - read_N);
      if (!next.allFinite()) return {};
      const double change = (next - force_N).cwiseAbs().maxCoeff();
      force_N = next;
      if (change <= kConverged * force_N.cwiseAbs().maxCoeff()) return force_N;
    }
    return {};
  }

 private:
  /// What curves that add go with (Observations::known), as far as these runs tell.
  double air(Index row, Index channel) const {
    return observations_.multiplicative ? 1 : observations_.known(row, channel);
  }

  /// Each effect acts on what those before it have made of the forces. What depends on the run before is
  /// judged by predictions, or its sign would follow the scatter, and nothing acts on it.
  VectorXd added_to(Index row, const VectorXd& force_N, const VectorXd& parameters) const {
    VectorXd made = force_N, by_previous = VectorXd::Zero(force_N.size());
    for (const std::size_t t : order_) {
      const bool previous = needs_previous(t);
      const VectorXd from = previous ? VectorXd(predicted_.row(row)) : made;
      for (Index c = 0; c < force_N.size(); ++c)
        if (applies(t, row, c))
          (previous ? by_previous : made)(c) += mean_changed(t, row, c, from, parameters) - from(c);
    }
    return made + by_previous;
  }

  /// Of logarithms, as the model is fitted: each effect acts on what all others have made, found in turns.
  VectorXd multiplied(Index row, const VectorXd& force_N, const VectorXd& parameters) const {
    const Index channels = force_N.size();
    Eigen::ArrayXXd own = Eigen::ArrayXXd::Ones(channels, static_cast<Index>(order_.size()));
    double change = 1;
    for (int turn = 0; turn < kMostInversions && change > kConverged; ++turn) {
      change = 0;
      for (std::size_t k = 0; k < order_.size(); ++k) {
        const std::size_t t = order_[k];
        if (needs_previous(t)) continue;
        const VectorXd from = force_N.array() * without_column(own, static_cast<Index>(k));
        for (Index c = 0; c < channels; ++c) {
          if (!applies(t, row, c)) continue;
          const double share = mean_changed(t, row, c, from, parameters) / from(c);
          change = std::max(change, std::abs(share - own(c, static_cast<Index>(k))));
          own(c, static_cast<Index>(k)) = share;
        }
      }
    }
    for (std::size_t k = 0; k < order_.size(); ++k)
      for (Index c = 0; c < channels && needs_previous(order_[k]); ++c)
        if (applies(order_[k], row, c))
          own(c, static_cast<Index>(k)) =
              mean_changed(order_[k], row, c, predicted_.row(row), parameters) / predicted_(row, c);
    return force_N.array() * own.rowwise().prod();
  }

  static Eigen::ArrayXd without_column(Eigen::ArrayXXd factors, Index column) {
    factors.col(column).setOnes();
    return factors.rowwise().prod();
  }

  bool needs_previous(std::size_t t) const { return model_.terms[t].effect->needs_previous; }

  bool in_tunnel(Index row) const { return observations_.in_tunnel[static_cast<std::size_t>(row)]; }

  /// By the baseline and the model, for what depends on the run before.
  void predict_forces() {
    MeanModel mean;
    bool needed = false;
    for (std::size_t t = 0; t < model_.terms.size(); ++t) {
      const ModelTerm& term = model_.terms[t];
      needed |= term.effect->needs_previous;
      const auto& covariates = term_covariates_[t];
      if (std::find(covariates.begin(), covariates.end(), nullptr) != covariates.end()) continue;
      mean.terms.push_back({.effect = term.effect,
                            .rotor = term.rotor,
                            .other = term.other,
                            .at_theory = term.at_theory,
                            .parameters = term.parameters});
    }
    if (!needed) return;
    predicted_ = predict_response(observations_, mean, observations_.all_rows());
    previous_.emplace(observations_, predicted_);
  }

  bool applies(std::size_t t, Index row, Index channel) const {
    const ModelTerm& term = model_.terms[t];
    if (term.rotor >= 0 && channel != term.rotor) return false;
    if (term.effect->tunnel_only && !in_tunnel(row)) return false;
    return std::none_of(term_covariates_[t].begin(), term_covariates_[t].end(),
                        [&](const Covariate* c) { return c == nullptr || std::isnan(c->at(row, channel)); });
  }

  /// `forces_N`: of all rotors, which the effect acts on.
  double mean_changed(std::size_t t, Index row, Index channel, const VectorXd& forces_N,
                      const VectorXd& parameters) const {
    const double force_N = forces_N(channel);
    const ModelTerm& term = model_.terms[t];
    std::vector<double> x;
    for (const Covariate* covariate : term_covariates_[t]) x.push_back(covariate->at(row, channel));
    const std::vector<double> zero =
        term.effect->of_zero ? at_zero(term_covariates_[t], row, channel) : std::vector<double>();
    Sample sample{.x = x,
                  .reference = term.reference,
                  .at_zero = zero,
                  .previous_N = term.effect->needs_previous ? previous_->force_N(row, channel) : kNaN,
                  .previous_error_N = term.effect->needs_previous ? previous_->error_N(row, channel) : 0,
                  .other_N = term.other < 0 ? 0 : forces_N(term.other),
                  .newtons_per_volt = observations_.newtons_per_volt(channel),
                  .radius_m = observations_.rig.propeller_radius_m,
                  .rig = &observations_.rig};
    const double* p = parameters.data() + first_[t];
    const double duration_s = observations_.duration_s(row);
    if (!term.effect->within_time() || duration_s == 0) return term.effect->force_N(sample, p, force_N);
    double sum = 0;
    for (int i = 0; i < kTimesWithinRun; ++i) {
      sample.time_s = duration_s * (i + 0.5) / kTimesWithinRun;
      sum += term.effect->force_N(sample, p, force_N);
    }
    return sum / kTimesWithinRun;
  }

  /// What the curve is over. Texts are numbered by the curve's own list; NaN: not in it.
  double condition(std::size_t k, Index row, Index channel) const {
    const Covariate& covariate = *curve_covariates_[k];
    const double x = covariate.at(row, channel);
    const auto& known = model_.curves[k].labels;
    if (known.empty() && covariate.labels.empty()) return x;
    if (known.empty() || covariate.labels.empty()) return kNaN;
    const auto found =
        std::find(known.begin(), known.end(), covariate.labels[static_cast<std::size_t>(x) - 1]);
    return found == known.end() ? kNaN : static_cast<double>(found - known.begin() + 1);
  }

  bool is_level(std::size_t k, Index row) const {
    const auto& levels = model_.curves[k].levels;
    return std::find(levels.begin(), levels.end(), condition(k, row, 0)) != levels.end();
  }

  double curve_sum(Index row, Index channel, const VectorXd& parameters) const {
    double sum = 0;
    for (std::size_t k = 0; k < model_.curves.size(); ++k) {
      const ModelCurve& curve = model_.curves[k];
      if (curve.rotor >= 0 && channel != curve.rotor) continue;
      const double x = condition(k, row, channel);
      double weight = curve_places_[k] == nullptr ? 1 : curve_places_[k]->weight(row);
      if (curve.times) weight = curve.times->strength.at(curve_times_[k]->at(row, channel));
      const double mean = curve.times ? curve.times->mean : 0;
      for (std::size_t b = 0; b < curve.coefficients.size(); ++b)
        sum += parameters(first_curve_[k] + static_cast<Index>(b)) * (weight * curve.column(b, x) - mean);
    }
    return sum;
  }

  const ModelVersion& model_;
  const Observations& observations_;
  std::vector<Index> first_, first_curve_;
  std::vector<std::size_t> order_;  // in which terms act
  std::vector<std::vector<const Covariate*>> term_covariates_;
  std::vector<const Covariate*> curve_covariates_;
  std::vector<const Place*> curve_places_;     // null: alike everywhere
  std::vector<const Covariate*> curve_times_;  // null: with no other condition
  MatrixXd predicted_;
  std::optional<PreviousRun> previous_;  // by them
};

/// Change-points are runs' names; the effects count runs.
ModelVersion with_change_points(ModelVersion model, const Observations& observations) {
  for (ModelTerm& term : model.terms) {
    if (!term.effect->has_change_point()) continue;
    const auto run = std::find(observations.name.begin(), observations.name.end(), term.first_run);
    if (run == observations.name.end())
      throw InputError(fmt::format("model {}: {} begins at run {}, which the campaign does not reduce",
                                   model.name(), term.label(), term.first_run));
    for (std::size_t k = 0; k < term.parameters.size(); ++k)
      if (term.effect->parameters[k].role == ParameterRole::kChangePoint)
        term.parameters[k] = static_cast<double>(run - observations.name.begin());
  }
  return model;
}

void check_rotors(const ModelVersion& model, int rotors) {
  const auto check = [&](int rotor, const std::string& label) {
    if (rotor >= rotors)
      throw InputError(fmt::format("model {}: {}, and this rig has {} rotors", model.name(), label, rotors));
  };
  for (const ModelTerm& term : model.terms) check(std::max(term.rotor, term.other), term.label());
  for (const ModelCurve& curve : model.curves) check(curve.rotor, curve.label());
}

/// How F changes with each parameter, rotors × parameters, by central differences.
MatrixXd parameter_slopes(const Forward& forward, Index row, const VectorXd& reading_N,
                          const VectorXd& parameters, const MatrixXd& covariance) {
  MatrixXd slopes = MatrixXd::Zero(reading_N.size(), parameters.size());
  for (Index k = 0; k < parameters.size(); ++k) {
    if (!(covariance(k, k) > 0)) continue;
    const double step = std::max(kDifference * std::sqrt(covariance(k, k)), 1e-7 * std::abs(parameters(k)));
    VectorXd above = parameters, below = parameters;
    above(k) += step;
    below(k) -= step;
    const auto high = forward.forces(row, reading_N, above), low = forward.forces(row, reading_N, below);
    if (high && low) slopes.col(k) = (*high - *low) / (2 * step);
  }
  return slopes;
}

/// How each rotor's F follows its own reading: what noise, calibration and tares of a cell are scaled by.
void scale_reading_errors(const Forward& forward, Index row, const VectorXd& reading_N,
                          const VectorXd& force_N, const VectorXd& parameters, RunCoefficients& run) {
  for (Index c = 0; c < reading_N.size(); ++c) {
    VectorXd moved = reading_N;
    moved(c) *= 1 + kReadingStep;
    const auto to = forward.forces(row, moved, parameters);
    const double slope = to ? ((*to)(c)-force_N(c)) / (moved(c) - reading_N(c)) : 1;
    const auto i = static_cast<std::size_t>(c);
    run.d_zero_N_per_V[i] *= slope;
    run.d_gain_N2_per_V[i] *= slope;
    run.d_tare_N_per_V[i] *= slope;
    run.thrust_standard_error_N[i] *= slope;
  }
}

}  // namespace

Reduction apply_model(const CampaignData& data, const Reduction& thesis, const ModelVersion& stored) {
  check_rotors(stored, data.info.rig.rotors);
  const Observations observations = observe_runs(data, {"thrust", stored.baseline});
  const ModelVersion model = with_change_points(stored, observations);
  const Forward forward(model, observations);
  const VectorXd parameters = model.parameters();
  std::map<std::string, Index> row_of;
  for (std::size_t row = 0; row < observations.name.size(); ++row)
    row_of.emplace(observations.name[row], static_cast<Index>(row));

  Reduction reduction = thesis;
  reduction.runs.clear();
  reduction.model = {model.version, model.effects(), model.covariance, model.dof, 0};
  for (const ModelTerm& term : model.terms) {
    reduction.model.effect_names.push_back(term.effect->name);
    if (term.effect->name == "air_pressure") reduction.model.pressure_exponent += term.parameters[0];
  }
  for (RunCoefficients run : thesis.runs) {
    const std::string& name = data.runs[run.run].run;
    const Index row = row_of.at(name);
    if (const std::string reason = forward.lacks(row); !reason.empty()) {
      reduction.left_out.push_back({name, reason});
      continue;
    }
    const VectorXd reading_N = Eigen::Map<const VectorXd>(run.thrust_N.data(), data.info.rig.rotors);
    const auto force_N = forward.forces(row, reading_N, parameters);
    if (!force_N || !(force_N->sum() > 0)) {
      reduction.left_out.push_back({name, "by the model there is no force that would read like this"});
      continue;
    }
    scale_reading_errors(forward, row, reading_N, *force_N, parameters, run);
    const MatrixXd slopes = parameter_slopes(forward, row, reading_N, parameters, model.covariance);
    run.d_parameter_N.assign(static_cast<std::size_t>(parameters.size()), {});
    for (Index c = 0; c < reading_N.size(); ++c) {
      run.thrust_N[static_cast<std::size_t>(c)] = (*force_N)(c);
      for (Index k = 0; k < parameters.size(); ++k)
        run.d_parameter_N[static_cast<std::size_t>(k)][static_cast<std::size_t>(c)] = slopes(c, k);
    }
    set_coefficients(data.info, run);
    reduction.runs.push_back(run);
  }
  if (reduction.runs.empty())
    throw InputError(fmt::format("no run can be reduced by model {}; run {}: {}", model.name(),
                                 reduction.left_out.back().run, reduction.left_out.back().reason));
  return reduction;
}

}  // namespace tunnelrig
