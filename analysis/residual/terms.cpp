#include "analysis/residual/terms.h"

#include "analysis/residual/joint_fit.h"
#include "analysis/residual/previous_run.h"
#include "analysis/residual/upper_median.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <set>
#include <string_view>

#include <fmt/format.h>

namespace tunnelrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Times within a run at which an effect that changes with time is evaluated.
constexpr int kTimes = 32;

/// cos(π j (t + ½)/kTimes), j = 0 … kShapes, scaled to give mean and cosine coefficients.
const MatrixXd& cosines() {
  static const MatrixXd table = [] {
    MatrixXd result(kShapes + 1, kTimes);
    for (int j = 0; j <= kShapes; ++j)
      for (int t = 0; t < kTimes; ++t)
        result(j, t) = (j == 0 ? 1.0 : 2.0) / kTimes * std::cos(std::numbers::pi * j * (t + 0.5) / kTimes);
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
    if (!term_.effect->within_time() || duration == 0) {
      put(row, channel, 0, change(changed(sample, force), force), response);
      return;
    }
    std::array<EffectJet, kShapes + 1> coefficient{};
    const std::size_t components = within_ ? response.value.size() : 1;
    for (int t = 0; t < kTimes; ++t) {
      sample.time_s = duration * (t + 0.5) / kTimes;
      const EffectJet then = changed(sample, force);
      for (std::size_t j = 0; j < components; ++j)
        coefficient[j] += cosines()(static_cast<Index>(j), t) * then;
    }
    put(row, channel, 0, change(coefficient[0], force), response);
    for (std::size_t j = 1; j < components; ++j)
      put(row, channel, j, over_mean(coefficient[j], coefficient[0], force), response);
  }

 private:
  double force_of(Index row, Index channel) const {
    return predicted_(row, channel) * (observations_.sign.size() > 0 ? observations_.sign(row) : 1);
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

  /// log(F'/F) where the model is multiplicative, F' − F where it is not: F' the run's mean, as measured.
  EffectJet change(const EffectJet& mean, double force) const {
    return observations_.multiplicative ? log_of_share(mean / force) : mean - force;
  }

  /// A course is measured over the run's own mean.
  EffectJet over_mean(const EffectJet& coefficient, const EffectJet& mean, double force) const {
    if (!observations_.multiplicative) return coefficient;
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

/// Whether a group has rows before this one and from it on: a step between groups is their difference.
bool is_within_a_group(const Observations& observations, const std::vector<int>& rows, double first) {
  std::set<int> before;
  return std::any_of(rows.begin(), rows.end(), [&](int row) {
    const int group = observations.group[static_cast<std::size_t>(row)];
    if (row >= first) return before.contains(group);
    before.insert(group);
    return false;
  });
}

/// Run numbers at which a change-point leaves enough blocks of `rows` on both sides: the first run of each
/// block, where a group goes on. Of a long table some, evenly spread: a step that is found is placed after.
std::vector<double> change_points(const Observations& observations, const std::vector<int>& rows) {
  std::vector<int> blocks;
  std::vector<double> first;
  for (const int row : rows) {
    const int block = observations.block[static_cast<std::size_t>(row)];
    if (blocks.empty() || blocks.back() != block) {
      blocks.push_back(block);
      first.push_back(row);
    }
  }
  if (static_cast<int>(blocks.size()) < 2 * kLeastBlocksBesideAStep) return {};
  std::vector<double> points{first.begin() + kLeastBlocksBesideAStep,
                             first.end() - kLeastBlocksBesideAStep + 1};
  const double least = kLeastShareBesideAStep * static_cast<double>(rows.size());
  std::erase_if(points, [&](double point) {
    const auto before = static_cast<double>(std::ranges::lower_bound(rows, point) - rows.begin());
    return before < least || static_cast<double>(rows.size()) - before < least ||
           !is_within_a_group(observations, rows, point);
  });
  constexpr std::size_t kMost = 300;
  const std::size_t every = std::max<std::size_t>(1, (points.size() + kMost - 1) / kMost);
  std::vector<double> some;
  for (std::size_t k = every / 2; k < points.size(); k += every) some.push_back(points[k]);
  return some;
}

/// Whether the forces that the baseline predicts differ by clearly more than its constants scatter. What
/// depends on the force of the run before would otherwise depend on that run's scatter, of which its group's
/// constant has a part; all the more where a run's scatter goes with that of the run before.
bool forces_differ(const Observations& observations) {
  if (observations.rows() <= observations.groups()) return true;
  const bool correlated = observations.scatter.run_correlation != std::array<double, 2>{0, 0};
  const double least = correlated ? 40 : 3;  // variance over that of the constants' errors
  const MatrixXd predicted =
      predict_response(observations, {known_terms(observations), {}}, observations.all_rows());
  const MatrixXd force = observations.multiplicative ? MatrixXd(predicted.array().log()) : predicted;
  const double variance = (force.rowwise() - force.colwise().mean()).squaredNorm();
  return variance > least * variance_of_constants(observations, predicted).sum();
}

/// What the air's state does to a force, or to a cell whose own temperature is not known.
bool is_of_air_or_of_a_cell_in_it(const Effect& effect) {
  constexpr std::array<std::string_view, 4> kOfAir = {"air_humidity", "air_pressure", "air_temperature",
                                                      "temperature_gradient"};
  const bool drift = effect.name == "span_drift_temperature" || effect.name == "zero_drift_temperature";
  return std::ranges::count(kOfAir, effect.name) > 0 || (drift && effect.form == "air");
}

/// Whether the response is a thrust that its measured speed, and the density of its air, make C_T; another
/// coefficient came as one.
bool is_made_c_t(const Observations& observations) {
  return observations.coefficient && !observations.of_air;
}

/// Whether a constant error is another share of each row's force: where that goes with the measured speed,
/// and the baseline is no line or power law, which would take it up.
bool shows_zero_offset(const Observations& observations) {
  const bool thrust =
      observations.of_air && !observations.coefficient && observations.find("speed_rpm") != nullptr;
  return observations.from_table && observations.multiplicative && observations.baseline_over.empty() &&
         (is_made_c_t(observations) || thrust);
}

}  // namespace

std::string Term::label() const {
  std::string text = effect->name;
  if (!effect->form.empty()) text += " (" + effect->form + ")";
  if (other >= 0) text += fmt::format(" from rotor {}", other + 1);
  if (rotor >= 0) text += fmt::format(" {} rotor {}", other >= 0 ? "to" : "of", rotor + 1);
  if (per_group) text += " per group";
  return text;
}

bool Term::same_way(const Term& term) const {
  return effect == term.effect && rotor == term.rotor && other == term.other && per_group == term.per_group;
}

TermResponse respond(const Term& term, const Observations& observations, const MatrixXd& predicted) {
  const MatrixXd zero = MatrixXd::Zero(observations.rows(), observations.channels());
  const Components none(1 + observations.shape.size(), zero);
  TermResponse response{none, {}};
  for (const EffectParameter& parameter : term.effect->parameters)
    response.derivative.push_back(parameter.role == ParameterRole::kChangePoint ? Components() : none);
  Evaluation evaluation(term, observations, predicted);
  for (Index row = 0; row < observations.rows(); ++row)
    for (Index channel = 0; channel < observations.channels(); ++channel)
      if (evaluation.applies(row, channel)) evaluation.evaluate(row, channel, response);
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

Testability testability(const Effect& effect, const Observations& observations) {
  Testability result;
  for (const std::string& name : effect.covariates) {
    const Covariate* covariate = observations.find(name);
    if (covariate == nullptr) {
      result.missing.push_back(name);
      continue;
    }
    if (const auto why = observations.not_usable.find(name); why != observations.not_usable.end())
      result.reason = name + " is " + why->second;
    if (!covariate->labels.empty()) result.reason = name + " is a column of texts";
    if (covariate->derived && covariate->value.isZero(0)) result.reason = name + " is 0 in every run";
  }
  // With the standard's air nothing changes, and a gradient is the drift of zero by another name.
  if ((effect.name == "air_temperature" || effect.name == "temperature_gradient") &&
      observations.assumed.contains("air_temperature_C"))
    result.missing.emplace_back("air_temperature_C");
  else if (effect.name == "air_temperature" && (!observations.of_air || observations.is_line()))
    result.reason =
        "only a table's thrust, coefficient, power or torque is held against a baseline without the density "
        "of its air";
  if (observations.of_no_quantity && !observations.is_line() && is_of_air_or_of_a_cell_in_it(effect))
    result.reason =
        "the response is a number without a unit: nothing says that a cell read it, or that the air is in it";
  if (effect.name == "axial_wind" && observations.of_no_quantity)
    result.reason = "nothing says that the response is a rotor's, through which the wind would go";
  if (effect.name == "tip_mach" && observations.from_table) {
    if (observations.find(kDiameter) == nullptr) result.missing.emplace_back(kDiameter);
    if (const auto why = observations.not_usable.find(std::string(kDiameter));
        why != observations.not_usable.end())
      result.reason = fmt::format("{} is {}", kDiameter, why->second);
  }
  if (effect.name == "air_pressure" && is_made_c_t(observations))
    result.reason = "the pressure is in the density that thrusts are divided by";
  if (effect.scope == EffectScope::kPair && observations.channels() < 2)
    result.reason = "the response has one channel";
  if (effect.tunnel_only &&
      std::none_of(observations.in_tunnel.begin(), observations.in_tunnel.end(), [](bool in) { return in; }))
    result.reason = "no run stands in a tunnel";
  if (effect.name == "bidirectional" && observations.multiplicative)
    result.reason = "the response has one sign";
  if (observations.coefficient && effect.name == "rotor_speed")
    result.reason = "the measured speed is part of the response";
  if (observations.coefficient && !is_made_c_t(observations) &&
      (effect.name == "nonlinearity" || effect.name == "bidirectional"))
    result.reason = "a coefficient is no force that a cell has read";
  if (effect.name == "zero_offset" && !shows_zero_offset(observations))
    result.reason =
        is_made_c_t(observations) && !observations.multiplicative
            ? "the baseline has a constant beside C_T"
            : "only a table's thrust whose speed was measured shows it, by how large it is beside small ones";
  if (effect.needs_previous && std::all_of(observations.previous.begin(), observations.previous.end(),
                                           [](int before) { return before < 0; }))
    result.reason = "the rows have no order, which a condition run_order would give them";
  else if (effect.needs_previous && !forces_differ(observations))
    result.reason = "the forces differ too little beside their scatter for the run before to tell";
  return result;
}

std::vector<std::string> own_conditions(const Effect& effect, const Observations& observations) {
  const bool of_force_alone = effect.covariates.empty() && effect.scope != EffectScope::kPair &&
                              !effect.needs_previous && !effect.has_change_point();
  if (!of_force_alone || observations.baseline_over.empty()) return effect.covariates;
  return {observations.baseline_over};
}

std::vector<Term> known_terms(const Observations& observations) {
  return observations.from_table ? std::vector<Term>() : terms_of_theory(observations);
}

std::vector<Term> terms_of_theory(const Observations& observations) {
  std::vector<Term> terms;
  for (const Effect& effect : all_effects())
    if (effect.theory_only && testability(effect, observations).ok())
      terms.push_back({.effect = &effect, .at_theory = true, .parameters = {*effect.theory()}});
  return terms;
}

std::vector<Term> ways_to_try(const Effect& effect, const Observations& observations,
                              const std::vector<int>& rows) {
  std::vector<Term> ways = {
      {.effect = &effect, .parameters = std::vector<double>(effect.parameters.size(), 0.0)}};
  const int channels = static_cast<int>(observations.channels());
  if (effect.scope == EffectScope::kRotor && channels > 1) {
    for (int rotor = 0; rotor < channels; ++rotor) {
      ways.push_back(ways[0]);
      ways.back().rotor = rotor;
    }
  }
  if (effect.scope == EffectScope::kPair) {
    const Term blank = ways[0];
    ways.clear();
    for (int to = 0; to < channels; ++to)
      for (int from = 0; from < channels; ++from) {
        if (to == from) continue;
        ways.push_back(blank);
        ways.back().rotor = to;
        ways.back().other = from;
      }
  }
  for (std::size_t k = 1; k < effect.parameters.size(); ++k) {
    const std::vector<double> grid = effect.parameters[k].role == ParameterRole::kChangePoint
                                         ? change_points(observations, rows)
                                         : effect.parameters[k].grid;
    std::vector<Term> shaped;
    for (const Term& way : ways)
      for (const double value : grid) {
        shaped.push_back(way);
        shaped.back().parameters[k] = value;
      }
    ways = std::move(shaped);
  }
  return ways;
}

}  // namespace tunnelrig
