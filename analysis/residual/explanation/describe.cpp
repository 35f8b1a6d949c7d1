// Structure without a name, as a curve with its band.
#include "analysis/residual/explanation/explanation_parts.h"
#include "analysis/residual/likelihood/cross_validation.h"
#include "calibration/distributions.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

namespace tunnelrig {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

/// Where a curve is drawn, and its columns there.
struct Drawn {
  double x = 0;
  VectorXd columns;
};

/// Of what a curve is over.
struct Stretch {
  double low, high;
};

/// What a curve is over in these rows: of one rotor's the rotor's own, since another may have gone further.
MatrixXd own_x(const Curve& curve, const std::vector<int>& rows) {
  const bool of_rotor = curve.rotor >= 0 && curve.x.cols() > 1;
  return of_rotor ? MatrixXd(curve.x(rows, curve.rotor)) : MatrixXd(curve.x(rows, Eigen::all));
}

/// Where the groups' ranges overlap. From one stretch to the next the groups' constants may have any
/// difference: the curve is not known there.
std::vector<Stretch> stretches_of(const Observations& observations, const std::vector<int>& rows,
                                  const Curve& curve) {
  const MatrixXd of_all = own_x(curve, rows);
  const Stretch all{of_all.minCoeff(), of_all.maxCoeff()};
  if (curve.strength || !curve.everywhere()) return {all};
  std::vector<Stretch> of_groups;
  for (const auto& [group, own] : rows_of_each(observations.group, rows)) {
    const MatrixXd x = own_x(curve, own);
    of_groups.push_back({x.minCoeff(), x.maxCoeff()});
  }
  std::sort(of_groups.begin(), of_groups.end(),
            [](const Stretch& a, const Stretch& b) { return a.low < b.low; });
  std::vector<Stretch> merged;
  for (const Stretch& each : of_groups) {
    if (merged.empty() || each.low > merged.back().high)
      merged.push_back(each);
    else
      merged.back().high = std::max(merged.back().high, each.high);
  }
  std::erase_if(merged, [](const Stretch& each) { return each.low == each.high; });
  return merged.empty() ? std::vector{all} : merged;
}

/// A curve is known but for a constant: it is drawn about its mean, and its band is of that.
void centre(std::vector<Drawn>& points) {
  VectorXd mean = VectorXd::Zero(points[0].columns.size());
  for (const Drawn& point : points) mean += point.columns / static_cast<double>(points.size());
  for (Drawn& point : points) point.columns -= mean;
}

/// What stands in a curve's columns where its condition is x.
VectorXd columns_at(const Curve& curve, double x) {
  VectorXd result(static_cast<Index>(curve.columns.size()));
  for (std::size_t b = 0; b < curve.columns.size(); ++b)
    result(static_cast<Index>(b)) = curve.shape == CurveShape::kLevels
                                        ? level_column(curve.levels, static_cast<int>(b) + 1, x)
                                        : tilted_column(curve.shape, curve.tilt, b, x, curve.low, curve.high);
  if (curve.strength)  // it turns about the mean
    result.array() -= curve_straight(curve.shape, curve.x.mean(), curve.low, curve.high);
  return result;
}

/// From x = `from` to `to`, evenly (in ln x of waves over that); where the rows have few values (`seen`,
/// ascending) at these, and nowhere further from all of them than half way to the next of the even ones: a
/// bend may have any height in between.
std::vector<double> places_to_draw(const std::vector<double>& seen, double from, double to,
                                   bool in_logarithm) {
  constexpr int kPoints = 25;
  const auto at = [&](int p) {
    const double u = static_cast<double>(p) / (kPoints - 1);
    return p == kPoints - 1 ? to : in_logarithm ? from * std::pow(to / from, u) : from + u * (to - from);
  };
  std::vector<double> places;
  if (std::ssize(seen) < kPoints)
    for (const double x : seen)
      if (x >= from && x <= to) places.push_back(x);
  if (places.size() > 1) return places;
  places.clear();
  for (int p = 0; p < kPoints; ++p) {
    const auto next = std::ranges::lower_bound(seen, (at(p - 1) + at(p)) / 2);
    if (seen.empty() || (next != seen.end() && *next <= (at(p) + at(p + 1)) / 2)) places.push_back(at(p));
  }
  return places;
}

std::vector<Drawn> drawn_at(const Curve& curve, const std::vector<double>& places) {
  std::vector<Drawn> points;
  for (const double x : places) points.push_back({x, columns_at(curve, x)});
  return points;
}

/// The runs' means of each column, channel below channel.
MatrixXd stacked(const std::vector<Components>& columns, const std::vector<int>& rows, Index channels) {
  MatrixXd result(static_cast<Index>(rows.size()) * channels, static_cast<Index>(columns.size()));
  for (std::size_t b = 0; b < columns.size(); ++b)
    result.col(static_cast<Index>(b)) = columns[b][0](rows, Eigen::all).reshaped();
  return result;
}

/// Of stacked columns, what the groups' constants and slopes cannot make.
MatrixXd beside_baseline(const Observations& observations, const std::vector<int>& rows, MatrixXd columns) {
  const auto n = static_cast<Index>(rows.size());
  const MatrixXd all = observations.baseline_columns(rows);
  for (const auto& [group, own] : places_of_each(observations.group, rows)) {
    const MatrixXd baseline = all(own, Eigen::all);
    const Eigen::CompleteOrthogonalDecomposition<MatrixXd> solver(baseline);
    for (Index channel = 0; channel < observations.channels(); ++channel) {
      auto part = columns.middleRows(channel * n, n);
      const MatrixXd given = part(own, Eigen::all);
      part(own, Eigen::all) = given - baseline * solver.solve(given);
    }
  }
  return columns;
}

/// With a normal prior of mean 0 on the last of the amplitudes.
AmplitudeFit with_prior(const AmplitudeFit& fit, const MatrixXd& precision) {
  MatrixXd information = fit.information;
  information.bottomRightCorner(precision.rows(), precision.cols()) += precision;
  const Eigen::CompleteOrthogonalDecomposition<MatrixXd> solver(information);
  return {solver.solve(fit.information * fit.amplitude), solver.pseudoInverse(), information};
}

/// What of a curve the baseline, an effect or another curve can do as well may be of any size in the fit, and
/// be taken back by them. Of the curves that fit about as well the smallest are meant: each has a normal
/// prior of twice the size of what all curves together do beside baseline and effects. `effects`: columns
/// before the curves'.
AmplitudeFit kept_to_their_size(const Observations& observations, const std::vector<int>& rows,
                                const std::vector<Components>& columns, std::size_t effects,
                                const std::vector<Index>& widths, const AmplitudeFit& fit) {
  constexpr double kWider2 = 4;
  const MatrixXd all = stacked(columns, rows, observations.channels());
  const auto count = static_cast<Index>(effects);
  MatrixXd whole = all.rightCols(all.cols() - count), own = beside_baseline(observations, rows, whole);
  if (effects > 0) {
    const MatrixXd rest = beside_baseline(observations, rows, all.leftCols(count));
    own -= rest * rest.completeOrthogonalDecomposition().solve(own);
  }
  whole.rowwise() -= whole.colwise().mean().eval();
  const double together = (own * fit.amplitude.tail(own.cols())).squaredNorm();
  if (!(together > 0)) return fit;
  MatrixXd precision = MatrixXd::Zero(own.cols(), own.cols());
  Index first = 0;
  for (const Index width : widths) {
    const auto x = whole.middleCols(first, width);
    precision.block(first, first, width, width) = x.transpose() * x / (kWider2 * together);
    first += width;
  }
  return with_prior(fit, precision);
}

std::vector<double> values_seen(const Curve& curve, const std::vector<int>& rows) {
  const MatrixXd x = own_x(curve, rows);
  std::vector<double> seen(x.data(), x.data() + x.size());
  std::ranges::sort(seen);
  seen.erase(std::unique(seen.begin(), seen.end()), seen.end());
  return seen;
}

/// Of a smooth curve two columns more than its data asked for: what it then lacks is less than its band.
Curve as_drawn(const Observations& observations, const Curve& curve, const std::vector<int>& rows) {
  const std::vector<Curve> forms = smooth_forms(observations, curve, rows);
  return forms.empty() ? curve : forms[std::min(curve.columns.size() + 1, forms.size() - 1)];
}

/// What is straight over a condition along which each group has a line (or a power law) of its own is that
/// line's, of which the fit gives the curve a part or not: it is taken out of what is drawn.
void take_out_baseline(const Observations& observations, const std::vector<int>& rows, const Curve& curve,
                       std::vector<Drawn>& points) {
  if (observations.slopes.cols() == 0 || curve.x.cols() != 1 || curve.strength || !curve.labels.empty())
    return;
  const auto n = static_cast<Index>(rows.size()), k = static_cast<Index>(curve.columns.size());
  const double low = curve.x.minCoeff(), high = curve.x.maxCoeff();
  for (const CurveShape shape : {CurveShape::kStraight, CurveShape::kLogStraight}) {
    if (is_of_logarithm(shape) && low <= 0) return;
    const auto straight = [&](double x) { return Eigen::Vector2d(1, curve_straight(shape, x, low, high)); };
    Eigen::MatrixX2d line(n, 2);
    MatrixXd columns(n, k);
    MatrixXd slopes(n, observations.slopes.cols());
    for (Index r = 0; r < n; ++r) {
      const int row = rows[static_cast<std::size_t>(r)];
      const double x = curve.x(row, 0);
      line.row(r) = straight(x).transpose();
      slopes.row(r) = observations.slopes.row(row);
      columns.row(r) = columns_at(curve, x).transpose();
    }
    const auto solver = line.colPivHouseholderQr();
    const MatrixXd bent = slopes - line * solver.solve(slopes);
    const MatrixXd centred = slopes.rowwise() - slopes.colwise().mean();
    if ((bent.colwise().norm().array() > 1e-6 * centred.colwise().norm().array()).all())
      continue;  // the groups' lines are over something else
    const MatrixXd taken = solver.solve(columns);
    for (Drawn& point : points) point.columns -= taken.transpose() * straight(point.x);
    return;
  }
}

/// The column of the runs sheet that a condition is made of: its own name where it is made of raw data or of
/// the order.
std::string column_behind(const std::string& derived) {
  if (derived == "hours_in_session" || derived == "hour_of_day") return "start_utc";
  if (derived == "air_temperature_rate_K_s") return "air_temperature_C";
  return derived;
}

/// A found curve as it is drawn.
struct FittedCurve {
  Curve curve;
  VectorXd amplitude;
  MatrixXd covariance;
  double own_share = 1;  // of its size, that the groups' constants and slopes cannot make
};

/// Of what columns make, by its rms about the mean.
double share_beside_baseline(const Observations& observations, const std::vector<int>& rows,
                             const std::vector<Components>& columns, const VectorXd& amplitude) {
  const MatrixXd made = stacked(columns, rows, observations.channels()) * amplitude;
  const double whole = (made.array() - made.mean()).matrix().norm();
  return whole > 0 ? std::min(1.0, beside_baseline(observations, rows, made).norm() / whole) : 1;
}

/// In one fit of all curves as they are drawn: together they are what the model says.
FittedCurve fit_as_drawn(const Observations& observations, const JointFit& fit, const Curve& found,
                         const std::vector<int>& rows) {
  FittedCurve result;
  const std::size_t effects = fit.linear.of_parameters.size();
  std::vector<Components> columns(fit.linear.columns.begin(),
                                  fit.linear.columns.begin() + static_cast<std::ptrdiff_t>(effects));
  std::vector<Index> widths;
  Index first = 0;
  for (const Curve& each : fit.model.curves) {
    const Curve drawn = as_drawn(observations, each, rows);
    if (each.is_like(found)) {
      result.curve = drawn;
      first = std::ssize(columns);
    }
    widths.push_back(std::ssize(drawn.columns));
    columns.insert(columns.end(), drawn.columns.begin(), drawn.columns.end());
  }
  const Components y = difference(response_components(observations), fit.linear.offset);
  AmplitudeFit all = fit_amplitudes(observations, y, columns, fit.variances, rows);
  if (found.x.size() > 0) all = kept_to_their_size(observations, rows, columns, effects, widths, all);
  const auto k = static_cast<Index>(result.curve.columns.size());
  result.amplitude = all.amplitude.segment(first, k);
  result.covariance = all.covariance.block(first, first, k, k);
  if (found.x.size() > 0)
    result.own_share = share_beside_baseline(observations, rows, result.curve.columns, result.amplitude);
  return result;
}

/// What is drawn, stretch by stretch.
std::vector<std::vector<Drawn>> pieces_to_draw(const Observations& observations, const Curve& curve,
                                               const std::vector<int>& rows) {
  std::vector<std::vector<Drawn>> pieces;
  if (curve.shape == CurveShape::kLevels) {
    std::vector<double> levels = curve.levels;
    std::sort(levels.begin(), levels.end());
    pieces = {drawn_at(curve, levels)};
  } else if (curve.x.size() == 0) {  // within the run
    Curve over_run = curve;
    over_run.low = 0;
    over_run.high = observations.duration_s.maxCoeff();
    pieces = {drawn_at(over_run, places_to_draw({}, 0, over_run.high, false))};
  } else {
    const std::vector<double> seen = values_seen(curve, rows);
    const bool in_logarithm = has_waves(curve.shape) && is_of_logarithm(curve.shape);
    for (const Stretch& stretch : stretches_of(observations, rows, curve))
      pieces.push_back(drawn_at(curve, places_to_draw(seen, stretch.low, stretch.high, in_logarithm)));
  }
  for (std::vector<Drawn>& points : pieces) take_out_baseline(observations, rows, curve, points);
  return pieces;
}

/// The points with their band, `t` standard errors, and the amplitude, which is the largest piece's.
void draw(const std::vector<Drawn>& points, const FittedCurve& fitted, double scale, double t,
          UnknownStructure& result) {
  double lowest = std::numeric_limits<double>::infinity(), highest = -lowest;
  for (const Drawn& point : points) {
    const double value = scale * point.columns.dot(fitted.amplitude);
    const double half =
        t * scale * std::sqrt(std::max(0.0, point.columns.dot(fitted.covariance * point.columns)));
    result.shape.push_back({point.x, value, value - half, value + half});
    lowest = std::min(lowest, value);
    highest = std::max(highest, value);
  }
  result.amplitude = std::max(result.amplitude, (highest - lowest) / 2);
}

}  // namespace

UnknownStructure describe(const Observations& observations, const JointFit& fit, const FoundCurve& found,
                          const std::vector<int>& rows) {
  UnknownStructure result{.covariate = found.curve.covariate,
                          .condition = found.curve.covariate,
                          .covariate_unit = {},
                          .place = found.curve.in_place(),
                          .times = found.curve.times(),
                          .rotor = found.curve.rotor,
                          .p_value = found.p,
                          .shape = {},
                          .levels = found.curve.shape == CurveShape::kLevels,
                          .labels = found.curve.labels,
                          .instead_of = found.instead_of,
                          .could_be = found.could_be};
  if (const Covariate* covariate = observations.find(result.condition)) {
    result.covariate_unit = covariate->unit;
    if (covariate->derived) result.covariate = column_behind(covariate->name);
    result.collinear_with = collinear_with(observations, *covariate);
  }
  const FittedCurve fitted = fit_as_drawn(observations, fit, found.curve, rows);
  // As of parameters: the curve is known no better than by how many blocks there are.
  const double others = static_cast<double>(leave_out_blocks(observations, rows).size()) - 1;
  const double t = student_t_quantile(0.975, std::max(1.0, others));
  for (std::vector<Drawn>& points : pieces_to_draw(observations, fitted.curve, rows)) {
    if (!fitted.curve.strength) centre(points);
    draw(points, fitted, observations.response_per_y(), t, result);
  }
  result.beside_baseline = fitted.own_share * result.amplitude;
  return result;
}

UnknownStructure describe_sessions(const Observations& observations, const MatrixXd& residual,
                                   const SessionScatter& scatter, const std::vector<int>& rows) {
  UnknownStructure result{.covariate = "session",
                          .condition = "session",
                          .covariate_unit = {},
                          .place = {},
                          .times = {},
                          .rotor = scatter.rotor,
                          .p_value = scatter.p,
                          .shape = {},
                          .labels = {},
                          .instead_of = {}};
  std::map<int, std::vector<double>> offsets;
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const auto run = residual.row(static_cast<Index>(r));
    const double mean = scatter.rotor < 0 ? -run.mean() : -run(scatter.rotor);
    if (!std::isnan(mean)) offsets[observations.block[static_cast<std::size_t>(rows[r])]].push_back(mean);
  }
  const auto mean_of = [](const std::vector<double>& values) {
    return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
  };
  double squares = 0, free = 0;  // of all sessions' runs: one may have a single run
  for (const auto& [block, values] : offsets) {
    for (const double value : values) squares += std::pow(value - mean_of(values), 2);
    free += static_cast<double>(values.size()) - 1;
  }
  free = std::max(1.0, free);
  double lowest = 1e300, highest = -1e300;
  for (const auto& [block, values] : offsets) {
    const double mean = mean_of(values);
    const double half = half_width_95(std::sqrt(squares / free / static_cast<double>(values.size())), free);
    result.shape.push_back({static_cast<double>(block + 1), mean, mean - half, mean + half});
    lowest = std::min(lowest, mean);
    highest = std::max(highest, mean);
  }
  result.amplitude = result.beside_baseline = (highest - lowest) / 2;
  return result;
}

}  // namespace tunnelrig
