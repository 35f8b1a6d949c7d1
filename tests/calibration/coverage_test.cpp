// How often the intervals hold the truth: many calibrations with a known truth, each from a seed of its own.
// docs/calibration.md quotes the table that this prints.
#include "calibration/load_cell.h"
#include "calibration/points.h"

#include <cmath>
#include <iostream>

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

using test::SyntheticCell;

struct CoverageCase {
  const char* name;
  int points = 10;
  SyntheticCell cell;
  LoadCellOptions options;
  int bad_points = 0;           // 10 to 100 standard deviations off, either way
  double standard_error_V = 0;  // of the run's mean
  int trials = 2000;
};

void PrintTo(const CoverageCase& of, std::ostream* out) { *out << of.name; }

class Coverage : public testing::TestWithParam<CoverageCase> {};

std::vector<CalibrationPoint> spoilt_points(const CoverageCase& of, std::mt19937& engine) {
  auto points = of.cell.points(of.points, engine);
  std::uniform_real_distribution<double> size(10, 100);
  for (int i = 0; i < of.bad_points; ++i) {  // the forces are random, so that any points will do
    const double side = engine() % 2 == 0 ? 1 : -1;
    points[static_cast<std::size_t>(i)].voltage_V += side * size(engine) * of.cell.reading_std_V;
  }
  return points;
}

TEST_P(Coverage, IntervalsHoldTheForceInNinetyFiveOfAHundred) {
  const CoverageCase& of = GetParam();
  constexpr unsigned kSeed = 9500;
  int mean_held = 0, reading_held = 0, unsettled = 0;
  double width_N = 0;
  for (int trial = 0; trial < of.trials; ++trial) {
    std::mt19937 engine(kSeed + static_cast<unsigned>(trial));
    const CellFit fit = fit_load_cell(spoilt_points(of, engine), of.options);
    unsettled += fit.convergence.converged ? 0 : 1;
    const double force = std::uniform_real_distribution<double>(of.cell.lowest_N, of.cell.highest_N)(engine);
    std::normal_distribution<double> normal(0, 1);
    const double mean = of.cell.voltage_at(force) + of.standard_error_V * normal(engine);
    const ForcePrediction of_mean = predict_force(fit, mean, of.standard_error_V);
    mean_held += of_mean.lower_N <= force && force <= of_mean.upper_N ? 1 : 0;
    const double reading = of.cell.voltage_at(force) + of.cell.reading_std_V * normal(engine);
    const ForcePrediction of_reading = predict_force(fit, reading, 0, ReadingScatter::kAsCalibration);
    reading_held += of_reading.lower_N <= force && force <= of_reading.upper_N ? 1 : 0;
    width_N += (of_reading.upper_N - of_reading.lower_N) / of.trials;
  }
  const double mean_share = 100.0 * mean_held / of.trials, reading_share = 100.0 * reading_held / of.trials;
  std::cout << fmt::format(
      "seeds {} to {}: {:<44} mean {:5.2f} %   new reading {:5.2f} % (width {:.4f} N){}\n", kSeed,
      kSeed + static_cast<unsigned>(of.trials) - 1, of.name, mean_share, reading_share, width_N,
      unsettled > 0 ? fmt::format(", {} not converged", unsettled) : "");
  // the median that scales a robust loss need not settle; such a fit says so
  EXPECT_LE(unsettled, of.options.loss == RobustLoss::kOrdinary ? 0 : of.trials / 500);
  EXPECT_GE(mean_share, 93);
  EXPECT_LE(mean_share, 97);
  EXPECT_GE(reading_share, 93);
  EXPECT_LE(reading_share, 97);
}

INSTANTIATE_TEST_SUITE_P(
    LoadCell, Coverage,
    testing::Values(
        CoverageCase{.name = "ordinary, 10 points"},
        CoverageCase{.name = "ordinary, 4 points", .points = 4, .cell = {.reading_std_V = 0.0003}},
        CoverageCase{.name = "ordinary, 10 points, noisy", .cell = {.reading_std_V = 0.06}},
        CoverageCase{.name = "ordinary, 10 points, run noise 2 mV", .standard_error_V = 0.002},
        CoverageCase{.name = "ordinary, 12 points, one gross left out", .points = 12, .bad_points = 1},
        CoverageCase{.name = "Deming, 10 points, gauge 0.4 of reading",
                     .cell = {.gauge_std_N = 0.005},
                     .options = {.gauge_force_N = 0.005}},
        CoverageCase{.name = "Deming, 10 points, gauge 1 × reading",
                     .cell = {.gauge_std_N = 0.012},
                     .options = {.gauge_force_N = 0.012}},
        CoverageCase{.name = "Deming, 20 points, gauge 2.5 × reading",
                     .points = 20,
                     .cell = {.gauge_std_N = 0.03},
                     .options = {.gauge_force_N = 0.03},
                     .standard_error_V = 0.002},
        CoverageCase{.name = "Huber, 20 points, 2 bad",
                     .points = 20,
                     .options = {.loss = RobustLoss::kHuber},
                     .bad_points = 2},
        CoverageCase{.name = "Cauchy, 20 points, 2 bad",
                     .points = 20,
                     .options = {.loss = RobustLoss::kCauchy},
                     .bad_points = 2},
        CoverageCase{.name = "Tukey, 20 points, 2 bad",
                     .points = 20,
                     .options = {.loss = RobustLoss::kTukey},
                     .bad_points = 2},
        CoverageCase{
            .name = "Tukey, 10 points, 1 bad", .options = {.loss = RobustLoss::kTukey}, .bad_points = 1},
        CoverageCase{
            .name = "Cauchy, 10 points, 1 bad", .options = {.loss = RobustLoss::kCauchy}, .bad_points = 1}),
    [](const auto& of) { return fmt::format("Case{}", of.index); });

}  // namespace
}  // namespace tunnelrig
