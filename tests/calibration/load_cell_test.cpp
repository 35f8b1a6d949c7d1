#include "calibration/load_cell.h"

#include "calibration/points.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

using test::message_of;
using test::SyntheticCell;
using testing::AllOf;
using testing::HasSubstr;

constexpr RobustLoss kLosses[] = {RobustLoss::kOrdinary, RobustLoss::kHuber, RobustLoss::kCauchy,
                                  RobustLoss::kTukey};

struct ClosedForm {
  double zero, gain, variance, zero_variance, gain_variance, covariance;
};

/// The textbook's sums.
ClosedForm ordinary_line(const std::vector<CalibrationPoint>& points,
                         const std::vector<double>& weights = {}) {
  double sw = 0, sx = 0, sy = 0;
  const auto w = [&](std::size_t i) { return weights.empty() ? 1 : weights[i]; };
  for (std::size_t i = 0; i < points.size(); ++i) {
    sw += w(i);
    sx += w(i) * points[i].applied_force_N;
    sy += w(i) * points[i].voltage_V;
  }
  const double x = sx / sw, y = sy / sw;
  double sxx = 0, sxy = 0, rss = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    sxx += w(i) * std::pow(points[i].applied_force_N - x, 2);
    sxy += w(i) * (points[i].applied_force_N - x) * (points[i].voltage_V - y);
  }
  ClosedForm line{.zero = y - sxy / sxx * x, .gain = sxy / sxx};
  for (std::size_t i = 0; i < points.size(); ++i) {
    rss += w(i) * std::pow(points[i].voltage_V - line.zero - line.gain * points[i].applied_force_N, 2);
  }
  line.variance = rss / (static_cast<double>(points.size()) - 2);
  line.gain_variance = line.variance / sxx;
  line.zero_variance = line.variance * (1 / sw + x * x / sxx);
  line.covariance = -line.variance * x / sxx;
  return line;
}

TEST(LoadCell, OrdinaryFitIsTheTextbooks) {
  std::mt19937 engine(1);
  const auto points = SyntheticCell{}.points(10, engine);
  const CellFit fit = fit_load_cell(points);
  const ClosedForm line = ordinary_line(points);
  EXPECT_TRUE(fit.convergence.converged) << fit.convergence.message;
  EXPECT_NEAR(fit.zero_V, line.zero, 1e-11);
  EXPECT_NEAR(fit.gain_V_per_N, line.gain, 1e-12);
  EXPECT_NEAR(fit.residual_std_V, std::sqrt(line.variance), 1e-12);
  EXPECT_NEAR(fit.covariance(0, 0), line.zero_variance, 1e-9 * line.zero_variance);
  EXPECT_NEAR(fit.covariance(1, 1), line.gain_variance, 1e-9 * line.gain_variance);
  EXPECT_NEAR(fit.covariance(0, 1), line.covariance, 1e-9 * line.zero_variance);
  EXPECT_EQ(fit.dof, 8);
}

TEST(LoadCell, AWeightIsThatManyReadings) {
  std::mt19937 engine(2);
  const auto points = SyntheticCell{}.points(8, engine);
  std::vector<CalibrationPoint> repeated;
  std::vector<double> weights;
  for (std::size_t i = 0; i < points.size(); ++i) {
    weights.push_back(static_cast<double>(1 + i % 3));
    for (std::size_t k = 0; k <= i % 3; ++k) repeated.push_back(points[i]);
  }
  const LoadCellOptions keep_all{.leave_out_gross = false};
  const CellFit fit = fit_load_cell(points, keep_all, weights);
  const ClosedForm line = ordinary_line(points, weights);
  const CellFit same = fit_load_cell(repeated, keep_all);
  EXPECT_NEAR(fit.gain_V_per_N, line.gain, 1e-11);
  EXPECT_NEAR(fit.gain_V_per_N, same.gain_V_per_N, 1e-11);
  EXPECT_NEAR(fit.zero_V, same.zero_V, 1e-10);
  EXPECT_NEAR(fit.covariance(1, 1), line.gain_variance, 1e-9 * line.gain_variance);
}

/// With every loss: another unit of force or voltage, and another zero, change the line as they should.
TEST(LoadCell, FitDoesNotDependOnUnitsOrZero) {
  for (const RobustLoss loss : kLosses) {
    for (const double gauge : {0.0, 0.03}) {
      std::mt19937 engine(5);
      const auto points = SyntheticCell{.gauge_std_N = gauge}.points(12, engine);
      const CellFit fit = fit_load_cell(points, {.loss = loss, .gauge_force_N = gauge});
      auto scaled = points;
      for (CalibrationPoint& point : scaled) {
        point.applied_force_N *= -100;
        point.voltage_V = 5 + 3000 * point.voltage_V;
      }
      const CellFit other = fit_load_cell(scaled, {.loss = loss, .gauge_force_N = 100 * gauge});
      EXPECT_NEAR(other.gain_V_per_N, -30 * fit.gain_V_per_N, 1e-6);
      EXPECT_NEAR(other.zero_V, 5 + 3000 * fit.zero_V, 1e-3);
      EXPECT_NEAR(other.covariance(1, 1) / fit.covariance(1, 1), 900, 0.01);
      EXPECT_NEAR(other.correlation, -fit.correlation, 1e-9);
      EXPECT_NEAR(other.dof, fit.dof, 1e-4);
    }
  }
}

TEST(LoadCell, APerfectLineIsRecoveredExactly) {
  for (const RobustLoss loss : kLosses) {
    std::mt19937 engine(6);
    const auto points = SyntheticCell{.reading_std_V = 0}.points(10, engine);
    const CellFit fit = fit_load_cell(points, {.loss = loss});
    EXPECT_NEAR(fit.zero_V, 0.34, 1e-12);
    EXPECT_NEAR(fit.gain_V_per_N, 0.242, 1e-12);
    EXPECT_EQ(fit.points_used(), 10);
    for (const CellPoint& point : fit.points) EXPECT_FALSE(point.suspicious);
  }
}

/// Deming's slope in closed form, with the reading's variance held by the same rule.
double deming_gain(const std::vector<CalibrationPoint>& points, double gauge_N) {
  const auto n = static_cast<double>(points.size());
  double x = 0, y = 0, sxx = 0, sxy = 0, syy = 0;
  for (const auto& point : points) {
    x += point.applied_force_N / n;
    y += point.voltage_V / n;
  }
  for (const auto& point : points) {
    sxx += std::pow(point.applied_force_N - x, 2);
    sxy += (point.applied_force_N - x) * (point.voltage_V - y);
    syy += std::pow(point.voltage_V - y, 2);
  }
  double gain = sxy / sxx;
  for (int i = 0; i < 1000; ++i) {
    const double variance = (syy - 2 * gain * sxy + gain * gain * sxx) / (n - 2);
    const double ratio = std::max(0.0, variance / (gauge_N * gauge_N) - gain * gain);
    gain =
        (syy - ratio * sxx + std::sqrt(std::pow(syy - ratio * sxx, 2) + 4 * ratio * sxy * sxy)) / (2 * sxy);
  }
  return gain;
}

TEST(LoadCell, DemingFitIsDemings) {
  for (const double gauge : {0.005, 0.02, 0.2}) {  // from a small share of the scatter to all of it
    std::mt19937 engine(7);
    const auto points = SyntheticCell{.gauge_std_N = gauge}.points(15, engine);
    const CellFit fit = fit_load_cell(points, {.gauge_force_N = gauge});
    EXPECT_TRUE(fit.convergence.converged) << fit.convergence.message;
    EXPECT_NEAR(fit.gain_V_per_N, deming_gain(points, gauge), 1e-8) << gauge;
    const double gauge_V = gauge * fit.gain_V_per_N;
    EXPECT_NEAR(std::pow(fit.reading_std_V, 2),
                std::max(0.0, std::pow(fit.residual_std_V, 2) - gauge_V * gauge_V), 1e-12);
  }
}

TEST(LoadCell, OneGrossPointIsNamedWithItsLineAndLeftOut) {
  std::mt19937 engine(8);
  const auto sound = SyntheticCell{}.points(10, engine);
  auto points = sound;
  points[6].voltage_V += 0.2;
  const CellFit fit = fit_load_cell(points);
  EXPECT_EQ(fit.points_used(), 9);
  EXPECT_TRUE(fit.points[6].gross);
  EXPECT_EQ(fit.points[6].line, 8);
  EXPECT_EQ(fit.points[6].weight, 0);
  EXPECT_LT(fit.points[6].p, 1e-3);
  EXPECT_NEAR(fit.points[6].residual_N, 0.2 / 0.242, 0.05);
  auto without = sound;
  without.erase(without.begin() + 6);
  EXPECT_NEAR(fit.gain_V_per_N, ordinary_line(without).gain, 1e-11);

  const CellFit kept = fit_load_cell(points, {.leave_out_gross = false});
  EXPECT_TRUE(kept.points[6].gross);
  EXPECT_EQ(kept.points_used(), 10);
  EXPECT_NEAR(kept.gain_V_per_N, ordinary_line(points).gain, 1e-11);
}

TEST(LoadCell, RobustLossesStayWithTheSoundPoints) {
  for (const RobustLoss loss : {RobustLoss::kHuber, RobustLoss::kCauchy, RobustLoss::kTukey}) {
    std::mt19937 engine(9);
    auto points = SyntheticCell{}.points(20, engine);
    for (const std::size_t bad : {3u, 11u, 17u}) points[bad].voltage_V += 0.4;
    const CellFit fit = fit_load_cell(points, {.loss = loss});
    EXPECT_TRUE(fit.convergence.converged) << fit.convergence.message;
    const double ordinary = ordinary_line(points).zero + 7 * ordinary_line(points).gain;
    const double truth = 0.34 + 0.242 * 7;
    EXPECT_GT(std::abs(ordinary - truth), 0.03);
    EXPECT_NEAR(fit.zero_V + 7 * fit.gain_V_per_N, truth, 0.004);
    EXPECT_LT(fit.points[3].weight, 0.1);
    EXPECT_GT(fit.points[4].weight, 0.5);
    EXPECT_LT(fit.residual_std_V, 0.006);  // the ordinary one is 0.15
  }
}

std::vector<CalibrationPoint> points_at(const std::vector<std::pair<double, double>>& force_and_voltage) {
  std::vector<CalibrationPoint> points;
  points.reserve(force_and_voltage.size());
  for (const auto& [force, voltage] : force_and_voltage) {
    points.push_back({.cell = 3,
                      .applied_force_N = force,
                      .voltage_V = voltage,
                      .line = static_cast<int>(points.size()) + 2});
  }
  return points;
}

std::string refusal(const std::vector<CalibrationPoint>& points, const LoadCellOptions& options = {},
                    const std::vector<double>& weights = {}) {
  return message_of([&] { fit_load_cell(points, options, weights); });
}

TEST(LoadCell, RefusesDegenerateInputWithTheReason) {
  EXPECT_THAT(refusal(points_at({{5, 1}, {6, 2}})),
              AllOf(HasSubstr("cell 3: 2 point(s) (line 2, 3)"), HasSubstr("at least three")));
  EXPECT_THAT(refusal({}), HasSubstr("0 point(s)"));
  EXPECT_THAT(refusal(points_at({{5, 1}, {5, 2}, {5, 1.5}, {5, 1}})),
              HasSubstr("all points are at one force (5 N)"));
  const double nan = std::nan("");
  EXPECT_THAT(refusal(points_at({{5, 1}, {6, nan}, {7, 2}})), HasSubstr("calibration.csv:3: cell 3"));
  EXPECT_THAT(refusal(points_at({{5, 1}, {INFINITY, 1}, {7, 2}})), HasSubstr("is not finite"));
  // a stuck channel, and noise alone
  EXPECT_THAT(refusal(points_at({{5, 1}, {6, 1}, {7, 1}, {8, 1}})), HasSubstr("cannot be told from zero"));
  EXPECT_THAT(refusal(points_at({{5, 1}, {6, 2}, {7, 2}, {8, 1}})), HasSubstr("cannot be told from zero"));
  EXPECT_THAT(refusal(points_at({{5, 1}, {6, 2}, {7, 3}}), {.gauge_force_N = 0.5}),
              HasSubstr("not small beside the spread"));
  EXPECT_THAT(refusal(points_at({{5, 1}, {6, 2}, {7, 3}}), {}, {1, 0, 1}), HasSubstr("calibration.csv:3"));
}

TEST(LoadCell, ThreePointsAreEnough) {
  const CellFit fit = fit_load_cell(points_at({{5, 1}, {6, 2.01}, {7, 3}}));
  EXPECT_EQ(fit.dof, 1);
  EXPECT_NEAR(fit.gain_V_per_N, 1, 1e-9);
}

/// Fieller's ends from the quadratic that they solve.
std::pair<double, double> fieller(const CellFit& fit, double voltage, double reading_variance, double t) {
  const double y = voltage - fit.zero_V, g = fit.gain_V_per_N, t2 = t * t;
  const Eigen::Matrix2d& c = fit.covariance;
  const double a = g * g - t2 * c(1, 1), b = -2 * y * g - 2 * t2 * c(0, 1),
               d = y * y - t2 * (reading_variance + c(0, 0));
  const double root = std::sqrt(b * b - 4 * a * d);
  return {(-b - root) / (2 * a), (-b + root) / (2 * a)};
}

TEST(LoadCell, PredictionWithEstimatedScatterIsFiellersWithStudentsT) {
  constexpr double kT[] = {12.7062047364, 4.3026527297, 2.3060041352};  // 97.5 %, dof 1, 2, 8
  const int counts[] = {3, 4, 10};
  for (std::size_t i = 0; i < 3; ++i) {
    std::mt19937 engine(12);
    const auto points = SyntheticCell{}.points(counts[i], engine);
    const CellFit fit = fit_load_cell(points);
    for (const double force : {0.0, 5.0, 9.0}) {
      const double voltage = fit.zero_V + force * fit.gain_V_per_N;
      const ForcePrediction line = predict_force(fit, voltage);
      const auto [lower, upper] = fieller(fit, voltage, 0, kT[i]);
      EXPECT_NEAR(line.force_N, force, 1e-12);
      EXPECT_NEAR(line.lower_N, lower, 1e-6 * (upper - lower));
      EXPECT_NEAR(line.upper_N, upper, 1e-6 * (upper - lower));
      EXPECT_EQ(line.extrapolated, force < fit.lowest_force_N || force > fit.highest_force_N);
      const ForcePrediction reading = predict_force(fit, voltage, 0, ReadingScatter::kAsCalibration);
      const auto [low, high] = fieller(fit, voltage, std::pow(fit.residual_std_V, 2), kT[i]);
      EXPECT_NEAR(reading.lower_N, low, 1e-6 * (high - low));
      EXPECT_NEAR(reading.upper_N, high, 1e-6 * (high - low));
    }
  }
}

TEST(LoadCell, PredictionWithKnownScatterAloneIsNormal) {
  std::mt19937 engine(13);
  const CellFit fit = fit_load_cell(SyntheticCell{.reading_std_V = 1e-7}.points(10, engine));
  const ForcePrediction known = predict_force(fit, 2, 0.0242);
  EXPECT_NEAR(known.standard_uncertainty_N, 0.1, 1e-4);
  EXPECT_NEAR(known.upper_N - known.force_N, 0.1959964, 1e-5);
  EXPECT_NEAR(known.force_N - known.lower_N, 0.1959964, 1e-5);
}

}  // namespace
}  // namespace tunnelrig
