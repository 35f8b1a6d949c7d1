#include "calibration/crosstalk.h"

#include "calibration/outliers.h"
#include "calibration/regression.h"
#include "datasets/error.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/LU>
#include <ceres/dynamic_autodiff_cost_function.h>
#include <ceres/problem.h>
#include <ceres/solver.h>

namespace tunnelrig {
namespace {

using Mask = Eigen::Array<bool, Eigen::Dynamic, 1>;

/// What a channel's reading is made of: columns of the axes' forces, of their magnitudes, and of the blocks.
struct Terms {
  std::vector<Eigen::Index> axes;  // columns of [matrix even] that the first columns of X belong to
  Eigen::MatrixXd X;
};

/// The distance of a channel's reading from the model, over the size of the channel's readings.
struct ChannelReading {
  const double* term;
  int terms;
  double reading, scale;

  template <typename T>
  bool operator()(T const* const* coefficient, T* residual) const {
    T predicted(0);
    for (int i = 0; i < terms; ++i) predicted += coefficient[0][i] * term[i];
    residual[0] = (reading - predicted) / scale;
    return true;
  }
};

bool loaded_both_ways(const CrosstalkTable& table, Eigen::Index axis) {
  return table.force_N.col(axis).minCoeff() < 0 && table.force_N.col(axis).maxCoeff() > 0;
}

Terms terms_of(const CrosstalkTable& table, const CrosstalkOptions& options, Eigen::Index channel,
               MatrixShape shape) {
  const Eigen::Index n = table.size();
  Terms terms;
  std::vector<Eigen::VectorXd> columns;
  for (Eigen::Index axis = 0; axis < n; ++axis) {
    if (shape == MatrixShape::kDiagonal && axis != channel) continue;
    terms.axes.push_back(axis);
    columns.emplace_back(table.force_N.col(axis));
  }
  const std::vector<Eigen::Index> plain = terms.axes;
  for (const Eigen::Index axis : plain) {
    if (!options.sign_terms || !loaded_both_ways(table, axis)) continue;
    terms.axes.push_back(n + axis);
    columns.emplace_back(table.force_N.col(axis).cwiseAbs());
  }
  const int zeros = options.zeros == BlockZero::kCommon ? 1 : table.blocks();
  for (int block = 0; block < zeros; ++block) {
    Eigen::VectorXd within = Eigen::VectorXd::Ones(table.force_N.rows());
    for (Eigen::Index i = 0; i < within.size() && zeros > 1; ++i) {
      within[i] = table.block[static_cast<std::size_t>(i)] == block ? 1 : 0;
    }
    columns.push_back(std::move(within));
  }
  terms.X.resize(table.force_N.rows(), static_cast<Eigen::Index>(columns.size()));
  for (std::size_t i = 0; i < columns.size(); ++i) terms.X.col(static_cast<Eigen::Index>(i)) = columns[i];
  return terms;
}

void check_table(const CrosstalkTable& table, const Terms& terms) {
  if (!table.force_N.allFinite() || !table.reading.allFinite()) {
    throw InputError::in(table.file, "a force or a reading is not finite");
  }
  for (Eigen::Index axis = 0; axis < table.size(); ++axis) {
    if ((table.force_N.col(axis).array() == 0).all()) {
      throw InputError::in(table.file, "{} is never loaded; its column of the matrix cannot be fitted",
                           table.axes[static_cast<std::size_t>(axis)]);
    }
  }
  if (table.force_N.rows() <= terms.X.cols()) {
    throw InputError::in(table.file,
                         "{} rows for {} coefficients per channel; at least one row more is needed",
                         table.force_N.rows(), terms.X.cols());
  }
  if (!regress(terms.X, table.reading.col(0))) {
    throw InputError::in(
        table.file,
        "the loads do not tell {} and the blocks' zeros apart: some axis was loaded only "
        "together with another, or with too few forces for a zero per block and a gain per sign",
        fmt::join(table.axes, ", "));
  }
}

/// Tests of every row, per channel the worst. They are made with the full matrix where the rows allow one, so
/// that crosstalk that a diagonal fit leaves over is not taken for bad rows.
std::vector<CrosstalkRow> test_table(const CrosstalkTable& table, const CrosstalkOptions& options) {
  const Eigen::Index n = table.size();
  const GrossRule rule{options.gross.p / static_cast<double>(n), options.gross.share_of_span};
  std::vector<CrosstalkRow> rows(table.line.size());
  for (std::size_t i = 0; i < rows.size(); ++i) rows[i].line = table.line[i];
  for (Eigen::Index channel = 0; channel < n; ++channel) {
    Terms terms = terms_of(table, options, channel, MatrixShape::kFull);
    if (!regress(terms.X, table.reading.col(channel))) {
      terms = terms_of(table, options, channel, options.shape);
    }
    const auto tests = test_rows(terms.X, table.reading.col(channel), rule);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const double p = std::min(1.0, tests[i].p * static_cast<double>(n));
      rows[i].gross = rows[i].gross || tests[i].gross;
      if (p > rows[i].p || (p == rows[i].p && !rows[i].channel.empty())) continue;
      rows[i].channel = table.channels[static_cast<std::size_t>(channel)];
      rows[i].studentised = tests[i].studentised;
      rows[i].p = p;
    }
  }
  return rows;
}

/// One channel's coefficients by Ceres, over the kept rows.
Eigen::VectorXd solve_channel(const Eigen::MatrixXd& X, const Eigen::VectorXd& reading,
                              FitConvergence& convergence) {
  const Eigen::MatrixXd rows = X.transpose();  // a row's terms side by side
  const auto terms = static_cast<int>(X.cols());
  const double scale = std::max(reading.cwiseAbs().maxCoeff(), 1e-300);
  Eigen::VectorXd coefficients = Eigen::VectorXd::Zero(X.cols());
  ceres::Problem problem;
  for (Eigen::Index i = 0; i < X.rows(); ++i) {
    auto* cost = new ceres::DynamicAutoDiffCostFunction<ChannelReading>(
        new ChannelReading{rows.col(i).data(), terms, reading[i], scale});
    cost->AddParameterBlock(terms);
    cost->SetNumResiduals(1);
    problem.AddResidualBlock(cost, nullptr, coefficients.data());
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.logging_type = ceres::SILENT;
  options.initial_trust_region_radius = 1e16;                  // Gauss–Newton steps: the model is linear
  options.gradient_tolerance = 1e-13 * X.lpNorm<1>() / scale;  // what rounding leaves
  options.function_tolerance = options.parameter_tolerance = 0;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  convergence.converged = convergence.converged && summary.termination_type == ceres::CONVERGENCE;
  convergence.iterations += static_cast<int>(summary.iterations.size());
  convergence.message = summary.message;
  return coefficients;
}

/// One channel, fitted to the kept rows.
struct Channel {
  Eigen::RowVectorXd coefficients;  // 2n, those of [matrix even]
  Eigen::VectorXd zeros;
  Eigen::VectorXd residuals;
  Eigen::MatrixXd estimator;  // 2n × rows: what the coefficients are of the readings
  int dof = 0;
};

Channel fit_channel(const CrosstalkTable& table, const CrosstalkOptions& options, const Mask& keep,
                    Eigen::Index channel, FitConvergence& convergence) {
  const Terms terms = terms_of(table, options, channel, options.shape);
  const Eigen::MatrixXd X = rows_where(terms.X, keep);
  const Eigen::VectorXd reading = rows_where(table.reading.col(channel), keep);
  const auto closed = regress(X, reading);
  if (!closed || closed->dof < 1) {
    throw InputError::in(table.file, "without the gross rows there are too few to fit the matrix");
  }
  const Eigen::VectorXd solved = solve_channel(X, reading, convergence);
  const auto axes = static_cast<Eigen::Index>(terms.axes.size());
  Channel fit{.coefficients = Eigen::RowVectorXd::Zero(2 * table.size()),
              .zeros = solved.tail(X.cols() - axes),
              .residuals = reading - X * solved,
              .estimator = Eigen::MatrixXd::Zero(2 * table.size(), X.rows()),
              .dof = closed->dof};
  fit.coefficients(terms.axes) = solved.head(axes).transpose();
  fit.estimator(terms.axes, Eigen::all) = closed->inverse_normal.topRows(axes) * X.transpose();
  return fit;
}

CrosstalkFit fit_channels(const CrosstalkTable& table, const CrosstalkOptions& options, const Mask& keep) {
  const Eigen::Index n = table.size();
  CrosstalkFit fit{.axes = table.axes,
                   .channels = table.channels,
                   .matrix = Eigen::MatrixXd(n, n),
                   .even = Eigen::MatrixXd(n, n),
                   .covariance = Eigen::MatrixXd(2 * n * n, 2 * n * n),
                   .residual_covariance = Eigen::MatrixXd(n, n),
                   .rows_used = static_cast<int>(keep.count()),
                   .dof = std::numeric_limits<int>::max()};
  fit.convergence.converged = true;
  std::vector<Channel> channels;
  for (Eigen::Index c = 0; c < n; ++c) {
    const Channel& one = channels.emplace_back(fit_channel(table, options, keep, c, fit.convergence));
    fit.matrix.row(c) = one.coefficients.head(n);
    fit.even.row(c) = one.coefficients.tail(n);
    fit.zeros.conservativeResize(one.zeros.size(), n);
    fit.zeros.col(c) = one.zeros;
    fit.dof = std::min(fit.dof, one.dof);
    for (Eigen::Index d = 0; d <= c; ++d) {  // the channels of one row err together
      const Channel& other = channels[static_cast<std::size_t>(d)];
      const double shared = one.residuals.dot(other.residuals) / std::sqrt(1.0 * one.dof * other.dof);
      fit.residual_covariance(c, d) = fit.residual_covariance(d, c) = shared;
      const Eigen::MatrixXd block = shared * one.estimator * other.estimator.transpose();
      fit.covariance.block(2 * n * c, 2 * n * d, 2 * n, 2 * n) = block;
      fit.covariance.block(2 * n * d, 2 * n * c, 2 * n, 2 * n) = block.transpose();
    }
  }
  return fit;
}

/// Signs of load, one per axis, that the matrix depends on: all combinations over the axes with even terms.
std::vector<Eigen::VectorXd> sign_patterns(const Eigen::MatrixXd& even) {
  std::vector<Eigen::VectorXd> patterns = {Eigen::VectorXd::Zero(even.cols())};
  for (Eigen::Index axis = 0; axis < even.cols(); ++axis) {
    if ((even.col(axis).array() == 0).all()) continue;
    const std::size_t before = patterns.size();
    for (std::size_t i = 0; i < before; ++i) {
      patterns.push_back(patterns[i]);
      patterns[i][axis] = 1;
      patterns.back()[axis] = -1;
    }
  }
  return patterns;
}

void check_invertible(const CrosstalkTable& table, const CrosstalkFit& fit) {
  for (const Eigen::VectorXd& signs : sign_patterns(fit.even)) {
    Eigen::MatrixXd gains = fit.matrix + fit.even * signs.asDiagonal();
    const double largest = gains.cwiseAbs().maxCoeff();
    for (Eigen::Index row = 0; row < gains.rows(); ++row) {
      gains.row(row) /= std::max(gains.row(row).norm(), 1e-12 * largest);
    }
    const Eigen::PartialPivLU<Eigen::MatrixXd> lu(gains);
    if (largest > 0 && lu.rcond() > 1e-3) continue;
    throw InputError::in(table.file,
                         "the readings {} do not tell the forces {} apart: the fitted matrix is singular",
                         fmt::join(table.channels, ", "), fmt::join(table.axes, ", "));
  }
}

/// That of the axis that the channel is there for.
double largest_gain(const CrosstalkFit& fit, Eigen::Index channel) {
  Eigen::Index axis = 0;
  fit.matrix.row(channel).cwiseAbs().maxCoeff(&axis);
  return fit.matrix(channel, axis);
}

std::vector<CrosstalkRow> suspicious_rows(const CrosstalkTable& table, const CrosstalkOptions& options,
                                          std::vector<CrosstalkRow> rows, const CrosstalkFit& fit) {
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const auto channel =
        std::find(table.channels.begin(), table.channels.end(), rows[i].channel) - table.channels.begin();
    const Eigen::VectorXd force = table.force_N.row(row).transpose();
    const Eigen::Index zero = fit.zeros.rows() == 1 ? 0 : table.block[i];
    const double predicted = fit.zeros(zero, channel) + fit.matrix.row(channel).dot(force) +
                             fit.even.row(channel).dot(force.cwiseAbs());
    rows[i].residual_N = (table.reading(row, channel) - predicted) / largest_gain(fit, channel);
    rows[i].left_out = rows[i].gross && options.leave_out_gross;
  }
  std::erase_if(rows, [&](const CrosstalkRow& row) { return row.p >= options.suspicious_p && !row.gross; });
  std::stable_sort(rows.begin(), rows.end(), [](const auto& a, const auto& b) { return a.p < b.p; });
  return rows;
}

}  // namespace

CrosstalkFit fit_crosstalk(const CrosstalkTable& table, const CrosstalkOptions& options) {
  if (table.force_N.rows() == 0)  // before anything looks for the least of its forces
    throw InputError::in(table.file, "there is no row of forces and readings");
  for (Eigen::Index channel = 0; channel < table.size(); ++channel) {
    check_table(table, terms_of(table, options, channel, options.shape));
  }
  const auto rows = test_table(table, options);
  Mask keep = Mask::Constant(table.force_N.rows(), true);
  for (std::size_t i = 0; i < rows.size() && options.leave_out_gross; ++i) {
    keep[static_cast<Eigen::Index>(i)] = !rows[i].gross;
  }
  CrosstalkFit fit = fit_channels(table, options, keep);
  check_invertible(table, fit);
  fit.suspicious = suspicious_rows(table, options, rows, fit);
  return fit;
}

CrosstalkFit::Forces CrosstalkFit::forces(const Eigen::VectorXd& reading, const Eigen::VectorXd& zero) const {
  const Eigen::Index n = matrix.rows();
  const auto patterns = sign_patterns(even);
  Forces best;
  double least_violation = std::numeric_limits<double>::infinity();
  for (const Eigen::VectorXd& signs : patterns) {
    const Eigen::MatrixXd inverse = (matrix + even * signs.asDiagonal()).inverse();
    const Eigen::VectorXd force = inverse * (reading - zero);
    const double violation = std::max(0.0, -signs.cwiseProduct(force).minCoeff());
    if (violation >= least_violation) continue;
    least_violation = violation;
    best.force_N = force;
    best.per_reading = inverse;
  }
  // ∂force/∂coefficient(c, j) = −inverse(:, c) · (force, |force|)(j)
  Eigen::VectorXd load(2 * n);
  load << best.force_N, best.force_N.cwiseAbs();
  Eigen::MatrixXd sensitivity(n, 2 * n * n);
  for (Eigen::Index c = 0; c < n; ++c) {
    sensitivity.middleCols(2 * n * c, 2 * n) = -best.per_reading.col(c) * load.transpose();
  }
  best.covariance = sensitivity * covariance * sensitivity.transpose();
  return best;
}

}  // namespace tunnelrig
