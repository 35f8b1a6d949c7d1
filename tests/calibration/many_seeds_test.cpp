// What holds of many calibrations only: how often an interval holds the truth, and a test rejects.
#include "calibration/cell_checks.h"
#include "calibration/distributions.h"
#include "calibration/known_truth.h"
#include "calibration/load_cell.h"

#include <cmath>
#include <iostream>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

using namespace test;

/// The matrix's own uncertainty, for forces in any direction.
TEST(Crosstalk, CovarianceCoversTheForces) {
  const unsigned seed = 600;
  std::cout << "seeds " << seed << " and following\n";
  SyntheticTable truth = both_ways();
  truth.noise = 0.01;
  constexpr int kTrials = 500;
  int held = 0;
  for (unsigned trial = 0; trial < kTrials; ++trial) {
    std::mt19937 engine(seed + trial);
    const CrosstalkFit fit = fit_crosstalk(truth.take(engine));
    const Eigen::Vector3d force(6, -4, 3);
    const auto back =
        fit.forces(truth.matrix * force + truth.even * force.cwiseAbs(), Eigen::Vector3d::Zero());
    const double z = (back.force_N[1] - force[1]) / std::sqrt(back.covariance(1, 1));
    held += std::abs(z) <= student_t_quantile(0.975, fit.dof) ? 1 : 0;
  }
  std::cout << fmt::format("coverage {:.2f} %\n", 100.0 * held / kTrials);
  EXPECT_GE(held, 0.93 * kTrials);
  EXPECT_LE(held, 0.97 * kTrials);
}

/// Every test rejects a sound cell about as often as it says, and finds an effect of a few times the noise.
TEST(CellChecks, TestsHaveTheirLevelAndSomePower) {
  const unsigned seed = 4100;
  std::cout << "seeds " << seed << " and following\n";
  constexpr int kTrials = 500;
  int lack = 0, quadratic = 0, hysteresis = 0, lack_found = 0, quadratic_found = 0, hysteresis_found = 0;
  const LoadCellOptions keep_all{.leave_out_gross = false};
  const auto bent = [](const Reading& r) { return 0.00006 * r.force_N * (r.force_N - 10); };
  const auto kinked = [](const Reading& r) { return r.force_N > 5 ? 0.002 * std::cos(r.force_N * 1.6) : 0; };
  const auto lagging = [](const Reading& r) { return std::string(r.direction) == "down" ? 0.0015 : 0; };
  for (unsigned trial = 0; trial < kTrials; ++trial) {
    const auto sound = fit_load_cell(take(cycle(), 0.001, seed + trial, nothing), keep_all).checks;
    lack += sound.lack_of_fit->p < 0.05 ? 1 : 0;
    quadratic += sound.linearity->p < 0.05 ? 1 : 0;
    hysteresis += sound.hysteresis->p < 0.05 ? 1 : 0;
    const auto checks = [&](auto extra) {
      return fit_load_cell(take(cycle(), 0.001, seed + trial, extra), keep_all).checks;
    };
    lack_found += checks(kinked).lack_of_fit->p < 0.05 ? 1 : 0;
    quadratic_found += checks(bent).linearity->p < 0.05 ? 1 : 0;
    hysteresis_found += checks(lagging).hysteresis->p < 0.05 ? 1 : 0;
  }
  for (const int rejected : {lack, quadratic, hysteresis}) {
    EXPECT_NEAR(rejected, 0.05 * kTrials, 4 * std::sqrt(0.05 * 0.95 * kTrials));
  }
  for (const int found : {lack_found, quadratic_found, hysteresis_found}) EXPECT_GT(found, 0.7 * kTrials);
}

TEST(LoadCell, ACoarseGaugeFlattensTheOrdinaryLineAndNotDemings) {
  const unsigned seed = 77;
  std::cout << "seed " << seed << '\n';
  std::mt19937 engine(seed);
  constexpr int kTrials = 300;
  double ordinary = 0, deming = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    const auto points = SyntheticCell{.gauge_std_N = 0.3}.points(40, engine);
    ordinary += fit_load_cell(points).gain_V_per_N / 0.242 / kTrials;
    deming += fit_load_cell(points, {.gauge_force_N = 0.3}).gain_V_per_N / 0.242 / kTrials;
  }
  // attenuation 1/(1 + u²/var F) with var F = 4.9²/12; the mean of 300 is good to 0.3 %
  EXPECT_NEAR(ordinary, 1 / (1 + 0.09 / 2.0008), 0.01);
  EXPECT_NEAR(deming, 1, 0.01);
}

}  // namespace
}  // namespace tunnelrig
