// What conditions do to rotors in pairs, to each in its own measure, and to all beside single ones.
#include "analysis/residual/explanation/explanation_output.h"
#include "analysis/residual/likelihood/joint_fit.h"
#include "analysis/residual/simulated.h"
#include "support/seeds.h"

#include <algorithm>
#include <array>

#include <gmock/gmock.h>

namespace tunnelrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using test::explained;

struct Rotors : testing::Test {
  static constexpr double kRunSigma = 0.002;
  std::mt19937_64 random{test::seed()};

  Observations observations() { return test::four_rotors(3, kRunSigma, random); }

  /// Since the session's first run, a quarter between runs.
  static VectorXd add_hours(Observations& o) {
    VectorXd hours(o.rows());
    for (Index row = 0; row < o.rows(); ++row) hours(row) = 0.25 * static_cast<double>(row % 8);
    o.covariates.push_back({"hours_in_session", hours, true});
    return hours;
  }

  static std::string names(const Explanation& e) {
    std::string all;
    for (const AdoptedEffect& adopted : e.adopted) all += adopted.term.label() + "; ";
    return all;
  }
};

/// A draught across the tunnel rolls the vehicle: no rotor alone, and no scatter of the roll either.
TEST_F(Rotors, WhatAConditionDoesInPairsIsNoScatter) {
  constexpr std::array<double, 4> kRoll = {1, -1, -1, 1};
  for (const double size : {1.0, 2.5}) {
    Observations o = observations();
    test::add_covariate(o, "draught_m_s", -1, 1, random);
    const VectorXd draught = o.find("draught_m_s")->value.col(0);
    MatrixXd y = o.y;
    for (std::size_t rotor = 0; rotor < kRoll.size(); ++rotor)
      y.col(static_cast<Index>(rotor)) += 1.7 * size * kRunSigma * kRoll[rotor] * draught;
    test::set_y(o, y);
    const Explanation e = explained(o);
    EXPECT_EQ(names(e), "") << size;
    const auto of_one_rotor = [](const UnknownStructure& u) {
      return u.covariate == "draught_m_s" && u.rotor >= 0;
    };
    EXPECT_TRUE(std::ranges::any_of(e.unknown, of_one_rotor)) << explanation_text(e);
  }
}

/// One scale under all four: nothing is left between rotors, which must silence nothing else.
TEST_F(Rotors, PartsOfATotalAreExplainedAsTheTotal) {
  for (const double exponent : {0.0, 0.5}) {
    Observations o = observations();
    if (exponent > 0) test::add_effect(o, "supply_voltage", {exponent});
    test::set_y(o, o.y.rowwise().mean().replicate(1, o.channels()));
    const Explanation e = explained(o);
    EXPECT_EQ(names(e), exponent > 0 ? "supply_voltage; " : "") << explanation_text(e);
    EXPECT_TRUE(e.unknown.empty()) << explanation_text(e);
    EXPECT_GT(e.detectable, 0);
    EXPECT_GT(e.noise_floor, 0);
  }
}

/// A wind that lifts the front rotors and presses the rear ones: beside curves of two, what is left of the
/// others goes down in all, as a wind from the front would have it.
TEST_F(Rotors, WhatTwoDoIsNoNameOfAll) {
  for (const double size : {1.5, 2.5}) {
    Observations o = observations();
    const VectorXd wind = o.find("tunnel_airspeed_m_s")->value.col(0);
    MatrixXd y = o.y;
    y.leftCols(2).colwise() += 30 * size * kRunSigma * wind.cwiseAbs2();
    y.rightCols(2).colwise() -= 30 * size * kRunSigma * wind.cwiseAbs2();
    test::set_y(o, y);
    const Explanation e = explained(o);
    EXPECT_THAT(names(e), testing::Not(testing::HasSubstr("axial_wind"))) << explanation_text(e);
    ASSERT_FALSE(e.unknown.empty());
    EXPECT_EQ(e.unknown[0].covariate, "tunnel_airspeed_m_s");
  }
}

/// Cells that each drift in their own measure: two of their own, and what all have.
TEST_F(Rotors, WhatAllDoIsFoundBesideSingleOnes) {
  Observations o = observations();
  const VectorXd hours = add_hours(o);
  constexpr std::array<double, 4> kDrift = {0.012, 0.012, 0.05, -0.03};
  MatrixXd y = o.y;
  for (std::size_t rotor = 0; rotor < kDrift.size(); ++rotor) {
    const auto force_N = o.value.col(static_cast<Index>(rotor)).array();
    const double newtons_per_h =
        kDrift[rotor] * (o.newtons_per_volt.size() > 0 ? o.newtons_per_volt(static_cast<Index>(rotor)) : 1);
    y.col(static_cast<Index>(rotor)).array() += (1 + newtons_per_h * hours.array() / force_N).log();
  }
  test::set_y(o, y);
  const Explanation e = explained(o);
  EXPECT_EQ(e.adopted.size(), 3u) << explanation_text(e);
  std::array<double, 4> drift = {};
  for (const AdoptedEffect& adopted : e.adopted) {
    EXPECT_EQ(adopted.term.effect->name, "zero_drift_time");
    EXPECT_GT(adopted.held_out_gain, 0);
    for (std::size_t rotor = 0; rotor < drift.size(); ++rotor)
      if (adopted.term.rotor < 0 || adopted.term.rotor == static_cast<int>(rotor))
        drift[rotor] += adopted.parameters[0].value;
  }
  for (std::size_t rotor = 0; rotor < drift.size(); ++rotor)
    EXPECT_NEAR(drift[rotor], kDrift[rotor], 0.004) << rotor;
}

/// ln((F + a + b)/F) is the sum of what each makes of the force only if one acts on what the other has made.
TEST_F(Rotors, TwoForcesThatAreAddedHaveNoProduct) {
  constexpr double kShare = 1, kDrift_V_per_h = 0.09;
  for (const double sign : {-1.0, 1.0}) {
    Observations o = observations();
    add_hours(o);
    test::add_covariate(o, "cable_force_N", 0, 0.8, random);
    test::add_effect(o, "cable_force", {sign * kShare});
    test::add_effect(o, "zero_drift_time", {kDrift_V_per_h});
    const MeanModel start{{{.effect = &test::effect_named("cable_force"), .parameters = {0.1}},
                           {.effect = &test::effect_named("zero_drift_time"), .parameters = {0.01}}},
                          {}};
    const JointFit fit = fit_jointly(o, start, o.all_rows());
    EXPECT_NEAR(fit.model.terms[0].parameters[0], sign * kShare, 0.01) << sign;
    EXPECT_NEAR(fit.model.terms[1].parameters[0], kDrift_V_per_h, 0.001) << sign;
  }
}

}  // namespace
}  // namespace tunnelrig
