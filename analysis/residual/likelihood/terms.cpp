#include "analysis/residual/likelihood/terms.h"

#include "analysis/residual/observations/previous_run.h"
#include "analysis/upper_median.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

namespace tunnelrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

using Cosines = Eigen::Matrix<double, kShapes + 1, kTimesWithinRun>;

/// cos(π j (t + ½)/kTimesWithinRun), j = 0 … kShapes, scaled to give mean and cosine coefficients.
const Cosines& cosines() {
  static const Cosines table = [] {
    Cosines result;
    for (int j = 0; j <= kShapes; ++j)
      for (int t = 0; t < kTimesWithinRun; ++t)
        result(j, t) = (j == 0 ? 1.0 : 2.0) / kTimesWithinRun *
                       std::cos(std::numbers::pi * j * (t + 0.5) / kTimesWithinRun);
    return result;
  }();
  return table;
}

/// Of a force, the share below which a model takes more than the force itself: far off, but by a number.
constexpr double kLeastShare = 0.02;

/// log u, and straight on below the least share.
EffectJet log_of_share(const EffectJet& u) {
  return u.a >= kLeastShare ? log(u) : u / kLeastShare + (std::log(kLeastShare) - 1);
}

class Evaluation {
 public:
  Evaluation(const Term& term, const Observations& observations, const MatrixXd& predicted)
      : term_(term),
        observations_(observations),
        predicted_(predicted),
        reference_(reference_of(*term.effect, observations)) {
    for (const std::string& name : term.effect->covariates) {
      covariates_.push_back(observations.find(name));
      is_order_.push_back(name == "run_order" && term.effect->has_change_point());
    }
    x_.resize(covariates_.size());
    for (std::size_t k = 0; k < term.parameters.size(); ++k) {
      parameters_[k] = EffectJet(term.parameters[k]);
      if (term.effect->parameters[k].role != ParameterRole::kChangePoint)
        parameters_[k].v[static_cast<Index>(k)] = 1;
    }
    within_ = term.effect->within_time() && !observations.shape.empty();
    if (term.effect->needs_previous) previous_.emplace(observations, predicted);
    if (observations.from_table) diameter_ = observations.find(kDiameter);
  }

  void set_amplitude(double amplitude) { parameters_[0].a = amplitude; }

  bool applies(Index row, Index channel) const {
    if (term_.rotor >= 0 && channel != term_.rotor) return false;
    if (term_.effect->tunnel_only && !observations_.in_tunnel[static_cast<std::size_t>(row)]) return false;
    return std::none_of(covariates_.begin(), covariates_.end(),
                        [&](const Covariate* covariate) { return std::isnan(covariate->at(row, channel)); });
  }

  /// Fills one entry of every component.
  void evaluate(Index row, Index channel, TermResponse& response) {
    Sample sample = sample_of(row, channel);
    const double force = force_of(row, channel);
    const double duration = observations_.duration_s(row);
    if (duration == 0 || !term_.effect->within_time()) {
      put(row, channel, 0, change(changed(sample, force), force, row, channel), response);
      return;
    }
    // Columns: the mean and the course's cosines; as one product of two, which the processor adds up side by
    // side.
    Eigen::Matrix<double, 1 + kMaxEffectParameters, kShapes + 1> coefficient;
    coefficient.setZero();
    for (int t = 0; t < kTimesWithinRun; ++t) {
      sample.time_s = duration * (t + 0.5) / kTimesWithinRun;
      const EffectJet jet = changed(sample, force);
      Eigen::Vector<double, 1 + kMaxEffectParameters> then;
      then << jet.a, jet.v;
      if (within_)
        coefficient += then * cosines().col(t).transpose();
      else
        coefficient.col(0) += cosines()(0, t) * then;
    }
    const auto jet_of = [&](std::size_t j) {
      const auto column = coefficient.col(static_cast<Index>(j));
      return EffectJet(column(0), column.tail<kMaxEffectParameters>());
    };
    put(row, channel, 0, change(jet_of(0), force, row, channel), response);
    for (std::size_t j = 1; j < response.value.size() && within_; ++j)
      put(row, channel, j, over_mean(jet_of(j), jet_of(0), force, row, channel), response);
  }

 private:
  double force_of(Index row, Index channel) const {
    return observations_.signed_force_N(predicted_(row, channel), row);
  }

  Sample sample_of(Index row, Index channel) {
    for (std::size_t k = 0; k < covariates_.size(); ++k)
      x_[k] = is_order_[k] ? position(row) : covariates_[k]->at(row, channel);
    if (term_.effect->of_zero) at_zero_ = at_zero(covariates_, row, channel);
    return {
        .x = x_,
        .reference = reference_,
        .at_zero = at_zero_,
        .previous_N = previous_ ? previous_->force_N(row, channel) : std::numeric_limits<double>::quiet_NaN(),
        .previous_error_N = previous_ ? previous_->error_N(row, channel) : 0,
        .other_N = term_.other < 0 ? 0 : force_of(row, term_.other),
        .newtons_per_volt =
            channel < observations_.newtons_per_volt.size() ? observations_.newtons_per_volt(channel) : 1,
        .radius_m =
            diameter_ != nullptr ? diameter_->value(row, 0) / 2 : observations_.rig.propeller_radius_m,
        .rig = &observations_.rig};
  }

  /// Change-points are places among the rows, whatever numbers the runs have and whichever are left out.
  double position(Index row) const {
    return observations_.position.size() > 0 ? observations_.position(row) : static_cast<double>(row);
  }

  EffectJet changed(const Sample& sample, double force) const {
    return term_.effect->jet_N(sample, parameters_, EffectJet(force));
  }

  /// log(F'/F) where the model is multiplicative, F' − F over what is known where it is not: F' the run's
  /// mean, as measured.
  EffectJet change(const EffectJet& mean, double force, Index row, Index channel) const {
    return observations_.multiplicative ? log_of_share(mean / force)
                                        : (mean - force) / observations_.known(row, channel);
  }

  /// A course is measured over the run's own mean.
  EffectJet over_mean(const EffectJet& coefficient, const EffectJet& mean, double force, Index row,
                      Index channel) const {
    if (!observations_.multiplicative) return coefficient / observations_.known(row, channel);
    const double least = kLeastShare * force;
    return mean.a >= least ? coefficient / mean : coefficient / least;
  }

  static void put(Index row, Index channel, std::size_t component, const EffectJet& value,
                  TermResponse& response) {
    response.value[component](row, channel) = value.a;
    for (std::size_t k = 0; k < response.derivative.size(); ++k)
      if (!response.derivative[k].empty())
        response.derivative[k][component](row, channel) = value.v[static_cast<Index>(k)];
  }

  const Term& term_;
  const Observations& observations_;
  const MatrixXd& predicted_;
  std::vector<double> reference_;
  std::vector<const Covariate*> covariates_;
  std::vector<bool> is_order_;  // of the rows
  std::vector<double> x_, at_zero_;
  EffectJet parameters_[kMaxEffectParameters];
  std::optional<PreviousRun> previous_;
  const Covariate* diameter_ = nullptr;  // of a table's propellers
  bool within_ = false;
};

}  // namespace

std::vector<const Components*> pointers_to(const std::vector<Components>& columns) {
  std::vector<const Components*> result;
  for (const Components& column : columns) result.push_back(&column);
  return result;
}

std::string Term::label() const { return effect->label(rotor, other) + (per_group ? " per group" : ""); }

bool Term::same_way(const Term& term) const {
  return effect == term.effect && rotor == term.rotor && other == term.other && per_group == term.per_group;
}

TermResponse respond(const Term& term, const Observations& observations, const MatrixXd& predicted) {
  return respond(term, Eigen::VectorXd::Constant(observations.rows(), term.parameters[0]), observations,
                 predicted);
}

TermResponse respond(const Term& term, const Eigen::VectorXd& amplitude, const Observations& observations,
                     const MatrixXd& predicted) {
  const MatrixXd zero = MatrixXd::Zero(observations.rows(), observations.channels());
  const Components none(1 + observations.shape.size(), zero);
  TermResponse response{none, {}};
  for (const EffectParameter& parameter : term.effect->parameters)
    response.derivative.push_back(parameter.role == ParameterRole::kChangePoint ? Components() : none);
  Evaluation evaluation(term, observations, predicted);
  for (Index row = 0; row < observations.rows(); ++row) {
    evaluation.set_amplitude(amplitude(row));
    for (Index channel = 0; channel < observations.channels(); ++channel)
      if (evaluation.applies(row, channel)) evaluation.evaluate(row, channel, response);
  }
  return response;
}

std::vector<double> reference_of(const Effect& effect, const Observations& observations) {
  std::vector<double> result;
  for (const std::string& name : effect.covariates) {
    const Covariate* covariate = observations.find(name);
    std::vector<double> values;
    for (Index row = 0; covariate != nullptr && row < covariate->value.rows(); ++row)
      if (!std::isnan(covariate->value(row, 0))) values.push_back(covariate->value(row, 0));
    result.push_back(upper_median(std::move(values)));
  }
  return result;
}

std::vector<std::size_t> order_of_action(const std::vector<Term>& terms) {
  std::vector<int> stages;
  for (const Term& term : terms) stages.push_back(term.per_group ? -1 : term.effect->stage());
  return order_of_action(stages);
}

}  // namespace tunnelrig
