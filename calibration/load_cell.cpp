#include "calibration/load_cell.h"

#include "calibration/distributions.h"
#include "calibration/outliers.h"
#include "calibration/regression.h"
#include "datasets/error.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <memory>
#include <numeric>

#include <ceres/autodiff_cost_function.h>
#include <ceres/loss_function.h>
#include <ceres/problem.h>
#include <ceres/solver.h>

namespace tunnelrig {
namespace {

using Mask = Eigen::Array<bool, Eigen::Dynamic, 1>;

// Tuning for 95 % efficiency on normal noise, in standard deviations (Holland and Welsch 1977).
constexpr double kHuberWidth = 1.345, kCauchyWidth = 2.385, kTukeyWidth = 4.685, kEfficiency = 0.95;
constexpr double kNormalMad = 1.482602218505602;  // standard deviation of a normal over its MAD
constexpr int kMaxRounds = 200;

/// The distance of a point from the line, over its standard deviation.
struct PointOnLine {
  double force_N, voltage_V, weight;
  double reading_std_V, gauge_force_N;

  template <typename T>
  bool operator()(const T* line, T* residual) const {
    const T &zero = line[0], &gain = line[1];
    const T variance = reading_std_V * reading_std_V + gain * gain * (gauge_force_N * gauge_force_N);
    residual[0] = sqrt(weight / variance) * (voltage_V - (zero + gain * force_N));
    return true;
  }
};

std::unique_ptr<ceres::LossFunction> make_loss(RobustLoss loss) {
  switch (loss) {
    case RobustLoss::kOrdinary:
      return std::make_unique<ceres::TrivialLoss>();
    case RobustLoss::kHuber:
      return std::make_unique<ceres::HuberLoss>(kHuberWidth);
    case RobustLoss::kCauchy:
      return std::make_unique<ceres::CauchyLoss>(kCauchyWidth);
    case RobustLoss::kTukey:
      return std::make_unique<ceres::TukeyLoss>(kTukeyWidth);
  }
  return nullptr;
}

/// The points that a fit uses, each scaled by the root of its weight: y = X line + ε, ε of one variance.
struct Scaled {
  Eigen::VectorXd force_N, voltage_V, weight;
  Eigen::MatrixXd X;
  Eigen::VectorXd y;

  Scaled(Eigen::VectorXd force, Eigen::VectorXd voltage, Eigen::VectorXd weights)
      : force_N(std::move(force)),
        voltage_V(std::move(voltage)),
        weight(std::move(weights)),
        X(force_N.size(), 2) {
    const Eigen::VectorXd root = weight.cwiseSqrt();
    X << root, root.cwiseProduct(force_N);
    y = root.cwiseProduct(voltage_V);
  }

  Eigen::Index size() const { return y.size(); }
  Scaled where(const Mask& keep) const {
    return {rows_where(force_N, keep), rows_where(voltage_V, keep), rows_where(weight, keep)};
  }
};

Scaled gather(std::span<const CalibrationPoint> points, std::span<const double> weights) {
  const auto n = static_cast<Eigen::Index>(points.size());
  Eigen::VectorXd force(n), voltage(n), weight = Eigen::VectorXd::Ones(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto at = static_cast<std::size_t>(i);
    force[i] = points[at].applied_force_N;
    voltage[i] = points[at].voltage_V;
    if (!weights.empty()) weight[i] = weights[at];
  }
  return {force, voltage, weight};
}

void check_points(std::span<const CalibrationPoint> points, std::span<const double> weights) {
  assert(weights.empty() || weights.size() == points.size());
  const int cell = points.empty() ? 0 : points.front().cell;
  std::vector<int> lines;
  for (const CalibrationPoint& point : points) lines.push_back(point.line);
  if (points.size() < 3) {
    throw InputError(fmt::format(
        "calibration.csv: cell {}: {} point(s){}; a line and its uncertainty take at least three", cell,
        points.size(), lines.empty() ? "" : fmt::format(" (line {})", fmt::join(lines, ", "))));
  }
  for (std::size_t i = 0; i < points.size(); ++i) {
    const CalibrationPoint& point = points[i];
    if (!std::isfinite(point.applied_force_N) || !std::isfinite(point.voltage_V)) {
      throw InputError::at("calibration.csv", point.line, "cell {}: force {:g} N at {:g} V is not finite",
                           cell, point.applied_force_N, point.voltage_V);
    }
    if (!weights.empty() && !(weights[i] > 0 && std::isfinite(weights[i]))) {
      throw InputError::at("calibration.csv", point.line, "cell {}: the weight {:g} is not above 0", cell,
                           weights[i]);
    }
  }
}

void check_spread(const Scaled& data, int cell, const LoadCellOptions& options) {
  const double lowest = data.force_N.minCoeff(), highest = data.force_N.maxCoeff();
  if (highest - lowest <= rounding_floor(data.force_N)) {
    throw InputError(fmt::format(
        "calibration.csv: cell {}: all points are at one force ({:g} N); a gain takes at least two forces",
        cell, lowest));
  }
  const double spread = std::sqrt((data.force_N.array() - data.force_N.mean()).square().mean());
  if (2 * options.gauge_force_N >= spread) {
    throw InputError(fmt::format(
        "calibration.csv: cell {}: the gauge's standard uncertainty of {:g} N is not small beside the spread "
        "of the applied forces ({:.3g} N standard deviation); they say nothing of the gain",
        cell, options.gauge_force_N, spread));
  }
}

struct Line {
  Eigen::Vector2d at;  // zero_V, gain_V_per_N
  double residual_std_V = 0;
  double reading_std_V = 0;
  FitConvergence convergence;

  /// What the model takes a residual's standard deviation to be; the gauge's share alone where the residuals
  /// are smaller than that.
  double model_std_V(double gauge_force_N) const { return std::hypot(reading_std_V, at[1] * gauge_force_N); }
};

/// One Ceres solve with the variances held.
void solve_round(const Scaled& data, const LoadCellOptions& options, Line& line) {
  const auto loss = make_loss(options.loss);
  ceres::Problem::Options ownership;
  ownership.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem problem(ownership);
  for (Eigen::Index i = 0; i < data.size(); ++i) {
    problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<PointOnLine, 1, 2>(new PointOnLine{
            data.force_N[i], data.voltage_V[i], data.weight[i], line.reading_std_V, options.gauge_force_N}),
        loss.get(), line.at.data());
  }
  ceres::Solver::Options solver;
  solver.linear_solver_type = ceres::DENSE_QR;
  solver.logging_type = ceres::SILENT;
  solver.initial_trust_region_radius = 1e12;  // Gauss–Newton steps: the model is all but linear
  solver.max_num_iterations = options.max_iterations;
  // a gradient that would move the line by 1e-8 of the scatter, or by less than rounding does
  const double scatter = line.model_std_V(options.gauge_force_N);
  const double share = std::max(1e-8, rounding_floor(data.voltage_V) / scatter);
  solver.gradient_tolerance = share * data.X.lpNorm<1>() / scatter;
  solver.function_tolerance = solver.parameter_tolerance = 0;
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &problem, &summary);
  line.convergence.converged = summary.IsSolutionUsable() && summary.termination_type == ceres::CONVERGENCE;
  line.convergence.iterations += static_cast<int>(summary.iterations.size());
  line.convergence.message = summary.message;
}

/// Scale of the residuals: root mean square about the line, or from the median with the two smallest, which a
/// line with two parameters can always make nothing of, left aside.
double residual_scale(const Eigen::VectorXd& residuals, RobustLoss loss) {
  if (loss == RobustLoss::kOrdinary) {
    return std::sqrt(residuals.squaredNorm() / static_cast<double>(residuals.size() - 2));
  }
  std::vector<double> sizes(residuals.begin(), residuals.end());
  for (double& size : sizes) size = std::abs(size);
  std::sort(sizes.begin(), sizes.end());
  sizes.erase(sizes.begin(), sizes.begin() + 2);
  const std::size_t n = sizes.size();
  return kNormalMad * 0.5 * (sizes[(n - 1) / 2] + sizes[n / 2]);
}

/// Splits the residual scatter into the reading's part and the gauge's.
void update_scales(const Scaled& data, const LoadCellOptions& options, Line& line) {
  const double gauge_V = line.at[1] * options.gauge_force_N;
  line.residual_std_V =
      std::max(residual_scale(data.y - data.X * line.at, options.loss), rounding_floor(data.voltage_V));
  const double rest = line.residual_std_V * line.residual_std_V - gauge_V * gauge_V;
  line.reading_std_V = rest > 0 ? std::sqrt(rest) : gauge_V == 0 ? line.residual_std_V : 0;
}

/// The start of the ordinary fit: through the points of least and greatest force.
Eigen::Vector2d line_through_ends(const Scaled& data) {
  Eigen::Index low = 0, high = 0;
  const double span = data.force_N.maxCoeff(&high) - data.force_N.minCoeff(&low);
  const double gain = (data.voltage_V[high] - data.voltage_V[low]) / span;
  return {data.voltage_V[low] - gain * data.force_N[low], gain};
}

/// The fit proper: Ceres solves with variances held, the variances follow, until both stand still.
Line fit_line(const Scaled& data, const LoadCellOptions& options) {
  Line line;
  if (options.loss == RobustLoss::kOrdinary) {
    line.at = line_through_ends(data);
  } else {
    line.at = least_trimmed_squares(data.X, data.y);
  }
  update_scales(data, options, line);
  double last_change = 0;
  for (int round = 0; round < kMaxRounds; ++round) {
    const Line before = line;
    solve_round(data, options, line);
    if (!line.convergence.converged) return line;
    update_scales(data, options, line);
    double change = line.reading_std_V - before.reading_std_V;
    // a median may go to and fro between two points for ever: meet in the middle
    if (change * last_change < 0) {
      change /= 2;
      line.reading_std_V = before.reading_std_V + change;
    }
    last_change = change;
    const double moved = (data.X * (line.at - before.at)).cwiseAbs().maxCoeff();
    if (std::max(moved, std::abs(change)) <= 1e-6 * line.residual_std_V) return line;
  }
  line.convergence.converged = false;
  line.convergence.message = fmt::format("the variances have not settled in {} rounds", kMaxRounds);
  return line;
}

/// What a loss makes of residuals in units of their scale.
struct Influence {
  Eigen::ArrayXd weight;  // ψ(u)/u
  double variance = 0;  // Huber's estimate of the variance that (XᵀX)⁻¹ is to be scaled by, over the scale²
};

/// Huber 1981, 7.6: K² [Σψ²/(n − p)] / (mean ψ')², K = 1 + (p/n) var ψ' / (mean ψ')².
Influence influence_of(const Eigen::ArrayXd& u, RobustLoss kind) {
  const auto loss = make_loss(kind);
  const auto n = static_cast<double>(u.size());
  constexpr double p = 2;
  Influence influence{.weight = Eigen::ArrayXd(u.size())};
  Eigen::ArrayXd slope(u.size());
  for (Eigen::Index i = 0; i < u.size(); ++i) {
    std::array<double, 3> rho{};  // ρ, ρ', ρ'' in u²: ψ = u ρ'
    loss->Evaluate(u[i] * u[i], rho.data());
    influence.weight[i] = rho[1];
    slope[i] = rho[1] + 2 * u[i] * u[i] * rho[2];
  }
  const double mean = slope.mean();
  const double k = 1 + p / n * (slope - mean).square().mean() / (mean * mean);
  influence.variance = k * k * (u * influence.weight).square().sum() / (n - p) / (mean * mean);
  return influence;
}

/// Fills covariance, degrees of freedom and scatter; returns the weights that the loss gives the points.
Eigen::ArrayXd set_uncertainty(const Scaled& data, const Line& line, CellFit& fit) {
  const double scale = line.model_std_V(fit.gauge_force_N);
  const Eigen::ArrayXd u = (data.y - data.X * line.at) / scale;
  const Influence influence = influence_of(u, fit.loss);
  fit.covariance = influence.variance * scale * scale * regress(data.X, data.y)->inverse_normal;
  fit.dof = std::max(1.0, influence.weight.sum() - 2);
  fit.residual_std_V = line.residual_std_V;
  if (fit.loss != RobustLoss::kOrdinary) {
    // of a good point, whatever the loss: Huber's and Cauchy's own variance still feels the bad ones
    fit.residual_std_V = scale * std::sqrt(kEfficiency * influence_of(u, RobustLoss::kTukey).variance);
  }
  const double gauge_V = fit.gain_V_per_N * fit.gauge_force_N;
  fit.reading_std_V = std::sqrt(std::max(0.0, fit.residual_std_V * fit.residual_std_V - gauge_V * gauge_V));
  return influence.weight;
}

double weighted_correlation(const Scaled& data, const Eigen::ArrayXd& loss_weight) {
  const Eigen::ArrayXd w = data.weight.array() * loss_weight / (data.weight.array() * loss_weight).sum();
  const Eigen::ArrayXd f = data.force_N.array() - (w * data.force_N.array()).sum();
  const Eigen::ArrayXd v = data.voltage_V.array() - (w * data.voltage_V.array()).sum();
  const double spread = std::sqrt((w * f * f).sum() * (w * v * v).sum());
  return spread > 0 ? (w * f * v).sum() / spread : 0;
}

void check_gain(const CellFit& fit, const Scaled& data) {
  const double u95 = std::max(fit.gain_u95_V_per_N(), rounding_floor(data.voltage_V) / fit.span_N());
  if (std::abs(fit.gain_V_per_N) > u95) return;
  throw InputError(fmt::format(
      "calibration.csv: cell {}: the gain ({:.4g} ± {:.2g} V/N at {:g} %) cannot be told from zero: the "
      "voltage does not follow the force",
      fit.cell, fit.gain_V_per_N, u95, 100 * fit.confidence));
}

/// Every point beside the line; `loss_weight` has one value per used point.
std::vector<CellPoint> describe_points(const Scaled& all, const std::vector<RowTest>& tests, const Mask& used,
                                       const Eigen::ArrayXd& loss_weight, const CellFit& fit) {
  std::vector<CellPoint> described;
  Eigen::Index next = 0;
  for (Eigen::Index i = 0; i < all.size(); ++i) {
    const RowTest& test = tests[static_cast<std::size_t>(i)];
    described.push_back({.force_N = all.force_N[i],
                         .voltage_V = all.voltage_V[i],
                         .residual_N = (all.voltage_V[i] - fit.zero_V) / fit.gain_V_per_N - all.force_N[i],
                         .leverage = test.leverage,
                         .studentised = test.studentised,
                         .p = test.p,
                         .weight = used[i] ? loss_weight[next++] : 0,
                         .gross = test.gross});
  }
  return described;
}

/// The checks leave gross points out whatever the fit does with them: one of them would drown what they test.
CellChecks check_good_points(std::span<const CalibrationPoint> points, const Scaled& all, const Mask& good,
                             const CellFit& fit) {
  std::vector<CalibrationPoint> kept;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (good[static_cast<Eigen::Index>(i)]) kept.push_back(points[i]);
  }
  return check_cell(kept, rows_where(all.weight, good), {fit.zero_V, fit.gain_V_per_N});
}

}  // namespace

CellFit fit_load_cell(std::span<const CalibrationPoint> points, const LoadCellOptions& options,
                      std::span<const double> weights) {
  check_points(points, weights);
  const Scaled all = gather(points, weights);
  check_spread(all, points.front().cell, options);

  const auto tests = test_rows(all.X, all.y, options.gross);
  Mask good(all.size());
  for (Eigen::Index i = 0; i < all.size(); ++i) good[i] = !tests[static_cast<std::size_t>(i)].gross;
  const bool leave_out = options.leave_out_gross && options.loss == RobustLoss::kOrdinary;
  const Mask used = leave_out ? good : Mask::Constant(all.size(), true);

  const Scaled data = all.where(used);
  const Line line = fit_line(data, options);
  CellFit fit{.cell = points.front().cell,
              .zero_V = line.at[0],
              .gain_V_per_N = line.at[1],
              .convergence = line.convergence,
              .loss = options.loss,
              .gauge_force_N = options.gauge_force_N,
              .confidence = options.confidence,
              .lowest_force_N = data.force_N.minCoeff(),
              .highest_force_N = data.force_N.maxCoeff()};
  const Eigen::ArrayXd loss_weight = set_uncertainty(data, line, fit);
  check_gain(fit, data);
  fit.correlation = weighted_correlation(data, loss_weight);
  fit.points = describe_points(all, tests, used, loss_weight, fit);
  for (std::size_t i = 0; i < points.size(); ++i) {
    fit.points[i].line = points[i].line;
    fit.points[i].suspicious = tests[i].p < options.suspicious_p;
  }
  fit.checks = check_good_points(points, all, good, fit);
  return fit;
}

int CellFit::points_used() const {
  return static_cast<int>(
      std::count_if(points.begin(), points.end(), [](const CellPoint& point) { return point.weight > 0; }));
}

double CellFit::residual_std_N() const { return residual_std_V / std::abs(gain_V_per_N); }

double CellFit::zero_u95_V() const {
  return student_t_quantile(0.5 + confidence / 2, dof) * std::sqrt(covariance(0, 0));
}

double CellFit::gain_u95_V_per_N() const {
  return student_t_quantile(0.5 + confidence / 2, dof) * std::sqrt(covariance(1, 1));
}

}  // namespace tunnelrig
