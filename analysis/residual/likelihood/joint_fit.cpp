#include "analysis/residual/likelihood/joint_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>

#include <ceres/ceres.h>

namespace tunnelrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

bool is_free(const Term& term, std::size_t k) {
  const EffectParameter& parameter = term.effect->parameters[k];
  if (parameter.role == ParameterRole::kChangePoint || term.per_group) return false;
  return !(k == 0 && term.at_theory);
}

std::vector<ParameterPlace> free_parameters(const MeanModel& model) {
  std::vector<ParameterPlace> result;
  for (std::size_t t = 0; t < model.terms.size(); ++t)
    for (std::size_t k = 0; k < model.terms[t].parameters.size(); ++k)
      if (is_free(model.terms[t], k)) result.push_back({t, k});
  return result;
}

/// All strata below each other, whitened, over σ, without what baseline and curves can absorb.
class Whitener {
 public:
  Whitener(const MixedModel& model, const NullFit& null, const std::vector<Curve>& curves)
      : model_(model), null_(null) {
    std::vector<const Components*> items;
    for (const Curve& curve : curves)
      for (const Components& column : curve.columns) items.push_back(&column);
    if (items.empty()) return;
    const MatrixXd columns = plain(items);
    const Eigen::ColPivHouseholderQR<MatrixXd> qr(columns);
    basis_ = qr.householderQ() * MatrixXd::Identity(columns.rows(), qr.rank());
  }

  MatrixXd operator()(const std::vector<const Components*>& items) const {
    MatrixXd result = plain(items);
    if (basis_.cols() > 0) result -= basis_ * (basis_.transpose() * result);
    return result;
  }

 private:
  MatrixXd plain(const std::vector<const Components*>& items) const {
    std::vector<Stacked> parts;
    Index rows = 0;
    for (std::size_t s = 0; s < model_.strata().size(); ++s) {
      parts.push_back(model_.stack(s, items));
      model_.project(s, null_.ratio[s], parts.back());
      parts.back() /= std::max(null_.sigma[s], 1e-300);
      rows += parts.back().rows();
    }
    MatrixXd result(rows, static_cast<Index>(items.size()));
    Index at = 0;
    for (const Stacked& part : parts) {
      result.middleRows(at, part.rows()) = part;
      at += part.rows();
    }
    return result;
  }

  const MixedModel& model_;
  const NullFit& null_;
  MatrixXd basis_;
};

/// R(y − Σ terms) and its derivatives by the free parameters.
class Residuals : public ceres::CostFunction {
 public:
  Residuals(const Observations& observations, const MeanModel& start, const Whitener& whitener,
            const Forces& forces)
      : observations_(observations),
        model_(start),
        free_(free_parameters(start)),
        whitener_(whitener),
        forces_(forces) {
    const Components y = response_components(observations);
    y_ = whitener_({&y}).col(0);
    set_num_residuals(static_cast<int>(y_.size()));
    mutable_parameter_block_sizes()->push_back(static_cast<int>(free_.size()));
  }

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const VectorXd at = Eigen::Map<const VectorXd>(parameters[0], std::ssize(free_));
    if (whitened_.size() == 0 || at != at_) {
      whitened_ = whitened_at(at);
      at_ = at;
    }
    Eigen::Map<VectorXd>(residuals, y_.size()) = y_ - whitened_.col(0);
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
          jacobians[0], y_.size(), std::ssize(free_)) = -whitened_.rightCols(std::ssize(free_));
    }
    return Eigen::Map<VectorXd>(residuals, y_.size()).allFinite();
  }

 private:
  /// What the terms add, and its derivatives.
  MatrixXd whitened_at(const VectorXd& parameters) const {
    MeanModel model = model_;
    for (std::size_t i = 0; i < free_.size(); ++i)
      model.terms[free_[i].term].parameters[free_[i].parameter] = parameters(static_cast<Index>(i));
    const LinearModel linear = linearise(observations_, {model.terms, {}}, forces_, Shapes::kAll);
    std::vector<const Components*> items = pointers_to(linear.columns);
    items.insert(items.begin(), &linear.offset);
    return whitener_(items);
  }

  const Observations& observations_;
  MeanModel model_;
  std::vector<ParameterPlace> free_;
  const Whitener& whitener_;
  const Forces& forces_;
  VectorXd y_;
  /// The last ones: the solver asks for the cost of a step, and for its derivatives where it takes it.
  mutable VectorXd at_;
  mutable MatrixXd whitened_;
};

bool solve(const Observations& observations, MeanModel& model, const Whitener& whitener,
           const Forces& forces) {
  const std::vector<ParameterPlace> free = free_parameters(model);
  if (free.empty()) return true;
  std::vector<double> values;
  for (const ParameterPlace& f : free) values.push_back(model.terms[f.term].parameters[f.parameter]);
  for (std::size_t i = 0; i < free.size(); ++i) {
    const EffectParameter& parameter = model.terms[free[i].term].effect->parameters[free[i].parameter];
    values[i] = std::clamp(values[i], parameter.lower, parameter.upper);
  }
  auto residuals = std::make_unique<Residuals>(observations, model, whitener, forces);
  VectorXd at_start(residuals->num_residuals());
  const double* start = values.data();
  // Ceres would say on standard error that it cannot begin where a force changes its sign.
  if (!residuals->Evaluate(&start, at_start.data(), nullptr)) return false;
  ceres::Problem problem;
  problem.AddResidualBlock(residuals.release(), nullptr, values.data());
  for (std::size_t i = 0; i < free.size(); ++i) {
    const EffectParameter& parameter = model.terms[free[i].term].effect->parameters[free[i].parameter];
    problem.SetParameterLowerBound(values.data(), static_cast<int>(i), parameter.lower);
    problem.SetParameterUpperBound(values.data(), static_cast<int>(i), parameter.upper);
  }
  ceres::Solver::Options options;
  options.max_num_iterations = 40;
  options.linear_solver_type = ceres::DENSE_QR;
  options.function_tolerance = 1e-9;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  for (std::size_t i = 0; i < free.size(); ++i)
    model.terms[free[i].term].parameters[free[i].parameter] = values[i];
  return summary.IsSolutionUsable();
}

constexpr int kMostRounds = 8;  // of forces and parameters in turns

/// Whether a round has left the parameters where they were, as far as anybody reads them.
bool has_settled(const MeanModel& before, const MeanModel& after) {
  constexpr double kLittle = 1e-3;
  const std::vector<ParameterPlace> free = free_parameters(after);
  return std::all_of(free.begin(), free.end(), [&](const ParameterPlace& f) {
    const EffectParameter& parameter = after.terms[f.term].effect->parameters[f.parameter];
    const double value = after.terms[f.term].parameters[f.parameter];
    const double size = std::max(std::abs(value), kLittle * (parameter.upper - parameter.lower));
    return std::abs(value - before.terms[f.term].parameters[f.parameter]) <= kLittle * size;
  });
}

}  // namespace

MeanModel MeanModel::without_term(std::size_t t) const {
  MeanModel rest = *this;
  rest.terms.erase(rest.terms.begin() + static_cast<std::ptrdiff_t>(t));
  return rest;
}

std::optional<Index> LinearModel::column_of(const ParameterPlace& place) const {
  const auto found = std::ranges::find(of_parameters, place);
  if (found == of_parameters.end()) return std::nullopt;
  return std::distance(of_parameters.begin(), found);
}

void LinearModel::clear_columns() {
  columns.clear();
  of_parameters.clear();
}

Components response_components(const Observations& observations) {
  Components result = {observations.y};
  result.insert(result.end(), observations.shape.begin(), observations.shape.end());
  return result;
}

Components difference(const Components& a, const Components& b) {
  Components result = a;
  for (std::size_t k = 0; k < result.size(); ++k) result[k] -= b[k];
  return result;
}

namespace {

/// The part of the baseline's lines beyond its constants: of each group, its own slopes fitted to `rows`.
/// From the group's mean, or where the baseline is a line from no load.
MatrixXd along_slopes(const Observations& observations, const MatrixXd& residual,
                      const std::vector<int>& rows) {
  MatrixXd result = MatrixXd::Zero(residual.rows(), residual.cols());
  if (observations.slopes.cols() == 0) return result;
  const auto all = places_of_each(observations.group);
  for (const auto& [group, own] : rows_of_each(observations.group, rows)) {
    const MatrixXd x = observations.slopes(own, Eigen::all), y = residual(own, Eigen::all);
    const Eigen::RowVectorXd middle = x.colwise().mean();
    const MatrixXd slope = (x.rowwise() - middle)
                               .completeOrthogonalDecomposition()
                               .solve(MatrixXd(y.rowwise() - y.colwise().mean()));
    const Eigen::RowVectorXd from = observations.line_of_cell ? Eigen::RowVectorXd::Zero(x.cols()) : middle;
    for (const Index row : all.at(group)) result.row(row) = (observations.slopes.row(row) - from) * slope;
  }
  return result;
}

/// Group constants and slopes fitted to what is left, `residual`, with `added` on top: in the response's
/// unit.
MatrixXd on_baseline(const Observations& observations, const MatrixXd& residual, MatrixXd added,
                     const std::vector<int>& rows) {
  MatrixXd sum = MatrixXd::Zero(observations.groups(), residual.cols());
  VectorXd count = VectorXd::Zero(observations.groups());
  for (const int row : rows) {
    sum.row(observations.group[static_cast<std::size_t>(row)]) += residual.row(row);
    count(observations.group[static_cast<std::size_t>(row)]) += 1;
  }
  added += along_slopes(observations, residual, rows);
  const Eigen::RowVectorXd overall = sum.colwise().sum() / count.sum();
  MatrixXd predicted(residual.rows(), residual.cols());
  for (Index row = 0; row < residual.rows(); ++row) {
    const Index group = observations.group[static_cast<std::size_t>(row)];
    Eigen::RowVectorXd constant =
        count(group) > 0 ? Eigen::RowVectorXd(sum.row(group) / count(group)) : overall;
    if (observations.line_of_cell) constant.setZero();
    Eigen::ArrayXXd y = constant + added.row(row);
    if (observations.multiplicative) y = y.exp();
    predicted.row(row) = observations.known.row(row).array() * y;
  }
  return predicted;
}

/// What each term acts on, `own` being what it adds (of logarithms: multiplies by): what the terms before it
/// have made, or a product of two would be counted with both.
std::vector<MatrixXd> acted_on(const Observations& observations, const std::vector<Term>& terms,
                               const MatrixXd& predicted, const std::vector<MatrixXd>& own) {
  std::vector<MatrixXd> result(terms.size());
  const bool of_logarithms = observations.multiplicative;
  const auto added_by = [&](std::size_t t) -> Eigen::ArrayXXd {
    return of_logarithms ? MatrixXd(own[t]) : MatrixXd(own[t].cwiseProduct(observations.known));
  };
  Eigen::ArrayXXd made = predicted;
  if (of_logarithms) made = made.log().eval();
  for (std::size_t t = 0; t < terms.size(); ++t) made -= added_by(t);
  for (const std::size_t t : order_of_action(terms)) {
    result[t] = of_logarithms ? MatrixXd(made.exp()) : MatrixXd(made);
    made += added_by(t);
  }
  return result;
}

}  // namespace

/// The baseline is what is left without the effects, and they act on what the baseline makes: found in turns.
Forces predict_forces(const Observations& observations, const MeanModel& model,
                      const std::vector<int>& rows) {
  constexpr int kMostTurns = 10;
  constexpr double kSettled = 1e-6, kNearly = 1e-2;
  const MatrixXd none = MatrixXd::Zero(observations.rows(), observations.channels());
  Forces forces{on_baseline(observations, observations.y, none, rows), {}};
  forces.acted_on.assign(model.terms.size(), forces.predicted);
  const Forces undisturbed = forces;
  double change = 0;
  for (int turn = 0; turn < kMostTurns && !model.terms.empty(); ++turn) {
    MatrixXd residual = observations.y, added = none;
    if (observations.beyond.size() > 0) {
      added = observations.beyond.rowwise().sum();
      residual -= added;
    }
    std::vector<MatrixXd> own(model.terms.size(), none);
    for (std::size_t t = 0; t < model.terms.size(); ++t) {
      const MatrixXd value = respond(model.terms[t], observations, forces.acted_on[t]).value[0];
      residual -= value;
      if (!model.terms[t].effect->needs_previous) own[t] = value;
      added += own[t];
    }
    MatrixXd predicted = on_baseline(observations, residual, added, rows);
    if (!predicted.allFinite()) break;  // a force that has changed its sign has no logarithm
    forces.acted_on = acted_on(observations, model.terms, predicted, own);
    change = (predicted - forces.predicted).cwiseAbs().maxCoeff();
    forces.predicted = std::move(predicted);
    if (change <= kSettled * forces.predicted.cwiseAbs().maxCoeff()) break;
  }
  // Effects as large as the force itself chase it for ever, and it grows.
  return change <= kNearly * undisturbed.predicted.cwiseAbs().maxCoeff() ? forces : undisturbed;
}

MatrixXd predict_response(const Observations& observations, const MeanModel& model,
                          const std::vector<int>& rows) {
  return predict_forces(observations, model, rows).predicted;
}

LinearModel linearise(const Observations& observations, const MeanModel& model, const Forces& forces,
                      Shapes shapes) {
  LinearModel linear{
      Components(1 + observations.shape.size(), MatrixXd::Zero(observations.rows(), observations.channels())),
      {}};
  if (observations.beyond.size() > 0) linear.offset[0] += observations.beyond.rowwise().sum();
  for (std::size_t t = 0; t < model.terms.size(); ++t) {
    const Term& term = model.terms[t];
    if (term.per_group) continue;  // a part of the baseline (Observations::slopes, beyond)
    TermResponse response = respond(term, observations, forces.acted_on[t]);
    for (std::size_t k = 0; k < linear.offset.size(); ++k) linear.offset[k] += response.value[k];
    for (std::size_t k = 0; k < response.derivative.size(); ++k)
      if (is_free(term, k) && (k == 0 || shapes == Shapes::kAll || !is_at_bound(term, k))) {
        linear.columns.push_back(std::move(response.derivative[k]));
        linear.of_parameters.push_back({t, k});
      }
  }
  for (const Curve& curve : model.curves)
    linear.columns.insert(linear.columns.end(), curve.columns.begin(), curve.columns.end());
  return linear;
}

std::optional<MeanModel> refit(const Observations& observations, const MeanModel& start,
                               const NullFit& variances, const std::vector<int>& rows) {
  MeanModel model = start;
  const MixedModel mixed(observations, rows, variances.ratio);
  const Whitener whitener(mixed, variances, model.curves);
  for (int round = 0; round < kMostRounds; ++round) {
    const MeanModel before = model;
    if (!solve(observations, model, whitener, predict_forces(observations, model, rows))) return {};
    if (has_settled(before, model)) break;
  }
  return model;
}

bool is_at_bound(const Term& term, std::size_t k) {
  const EffectParameter& parameter = term.effect->parameters[k];
  const double margin = 1e-6 * (parameter.upper - parameter.lower);
  return term.parameters[k] <= parameter.lower + margin || term.parameters[k] >= parameter.upper - margin;
}

bool at_bound(const JointFit& fit, const Term& term) {
  return std::ranges::any_of(fit.at_bound, [&](const ParameterPlace& place) {
    return place.parameter == 0 && fit.model.terms[place.term].same_way(term);
  });
}

JointFit fit_jointly(const Observations& observations, const MeanModel& start, const std::vector<int>& rows) {
  JointFit fit{.model = start, .linear = {}, .variances = {}, .at_bound = {}};
  const MixedModel mixed(observations, rows);
  const Components y = response_components(observations);
  // Variances depend on the mean and the mean on the variances, forces on the mean, and large effects on the
  // forces.
  for (int round = 0; round < kMostRounds; ++round) {
    const Forces forces = predict_forces(observations, fit.model, rows);
    fit.linear = linearise(observations, fit.model, forces);
    fit.variances = CandidateScan(mixed, fit.linear.columns, {}).null_fit(difference(y, fit.linear.offset));
    const Whitener whitener(mixed, fit.variances, fit.model.curves);
    const MeanModel before = fit.model;
    fit.converged = solve(observations, fit.model, whitener, forces);
    fit.settled = round > 0 && has_settled(before, fit.model);
    if (fit.settled) break;
  }
  fit.linear = linearise(observations, fit.model, predict_forces(observations, fit.model, rows));
  fit.variances = CandidateScan(mixed, fit.linear.columns, {}).null_fit(difference(y, fit.linear.offset));
  for (const ParameterPlace& f : free_parameters(fit.model))
    if (is_at_bound(fit.model.terms[f.term], f.parameter)) fit.at_bound.push_back(f);
  return fit;
}

}  // namespace tunnelrig
