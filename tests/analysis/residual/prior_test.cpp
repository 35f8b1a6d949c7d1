// What decides between names that fit alike, and which form of a name is taken.
#include "analysis/residual/explanation/explanation_parts.h"
#include "analysis/residual/simulated.h"
#include "support/seeds.h"

#include <cmath>
#include <functional>

#include <gmock/gmock.h>

namespace tunnelrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using test::explained;
using testing::AnyOf;
using testing::Contains;
using testing::ElementsAre;

struct Prior : testing::Test {
  std::mt19937_64 random{test::seed()};

  Observations observations() {
    Observations o = test::simulate(
        {.runs_of_block = std::vector<int>(16, 8), .channels = 4, .sigma = 0.002, .session_ratio = 0.2},
        random);
    test::add_covariate(o, "air_pressure_Pa", 99300, 103300, random);
    return o;
  }
  /// A share of clipped samples that goes with the pressure, and with the thrust a little better.
  Observations with_clipping(double exponent, double noise_Pa) {
    Observations o = observations();
    MatrixXd& pressure_Pa = o.covariates.back().value;
    const MatrixXd clipped = 0.2 - 0.1 * (pressure_Pa.array() / 101325).log();
    test::add_effect(o, "air_pressure", {exponent});
    std::normal_distribution<double> reading(0, noise_Pa);
    for (Index row = 0; row < o.rows(); ++row) pressure_Pa(row, 0) += reading(random);
    o.covariates.push_back({"clip_fraction", clipped});
    return o;
  }
  /// C_T of one propeller at speeds that are drawn.
  Observations coefficients(const std::function<double()>& draw_rpm) {
    Observations o = test::simulate({.runs_of_block = std::vector<int>(16, 8), .groups = 1}, random);
    o.from_table = o.coefficient = true;
    Covariate speed{"speed_rpm", VectorXd(o.rows())};
    for (Index row = 0; row < o.rows(); ++row) speed.value(row, 0) = draw_rpm();
    o.covariates.push_back(speed);
    test::add_covariate(o, "air_temperature_C", 19.9, 20.1, random);
    return o;
  }
  static std::vector<std::string> names(const Explanation& e) {
    std::vector<std::string> result;
    for (const AdoptedEffect& adopted : e.adopted) result.push_back(adopted.term.effect->name);
    return result;
  }
};

TEST_F(Prior, WhereTheoryGivesTheCoefficientANameIsLikelier) {
  const Explanation e = explained(with_clipping(1, 8));
  ASSERT_EQ(names(e), std::vector<std::string>{"air_pressure"});
  EXPECT_THAT(e.adopted[0].confounded_with, Contains("adc_clipping"));
}

/// Which they do once in twenty times.
TEST_F(Prior, TheorysCoefficientIsTakenWhereTheDataDoNotSpeakAgainstIt) {
  constexpr int kSamples = 10;
  int taken = 0;
  for (int i = 0; i < kSamples; ++i) {
    Observations o = observations();
    test::add_effect(o, "air_pressure", {1});
    const Explanation e = explained(o);
    ASSERT_FALSE(e.adopted.empty());
    EXPECT_EQ(names(e)[0], "air_pressure");
    taken += e.adopted[0].parameters[0].theory && e.adopted[0].parameters[0].value == 1 ? 1 : 0;
  }
  EXPECT_GE(taken, kSamples - 3);
  Observations o = observations();
  test::add_effect(o, "air_pressure", {2});
  const ParameterEstimate found = explained(o).adopted.at(0).parameters[0];
  EXPECT_FALSE(found.theory);
  EXPECT_NEAR(found.value, 2, 5 * found.standard_error);
}

/// Two speeds tell no exponent from a coefficient.
TEST_F(Prior, StiffBladesAreTheRule) {
  Observations o = coefficients([this] { return std::bernoulli_distribution(0.5)(random) ? 4000 : 6000; });
  const MatrixXd speed_rpm = o.find("speed_rpm")->value;
  test::set_y(o, o.y + 0.03 * (speed_rpm.array() / 5000).log().matrix());
  const Explanation e = explained(o);
  ASSERT_EQ(e.adopted.size(), 1u);
  EXPECT_THAT(names(e)[0], AnyOf("reynolds_number", "tip_mach"));
  EXPECT_THAT(e.adopted[0].confounded_with, Contains("blade_flex"));
}

/// A power and a square of the speed make any bend over it.
TEST_F(Prior, TwoNamesOverOneConditionAreMoreThanItsBend) {
  Observations o =
      coefficients([this] { return std::uniform_real_distribution<double>(3000, 7000)(random); });
  const Eigen::ArrayXd from_middle = (o.find("speed_rpm")->value.col(0).array() - 4500) / 2000;
  test::set_y(o, o.y + (0.008 * from_middle + 0.005 * from_middle.square()).matrix());
  EXPECT_LE(explained(o).adopted.size(), 1u);
}

/// Of an effect so steep that its formula cannot be what happens, the form at its bound is no name.
TEST_F(Prior, ANameAtItsBoundIsNone) {
  Observations o = observations();
  test::add_covariate(o, "supply_voltage_V", 15.5, 16.5, random);
  const MatrixXd steep = 8 * (o.find("supply_voltage_V")->value.array() / 16).log();
  test::set_y(o, o.y.colwise() + VectorXd(steep));
  const Explanation e = explained(o);
  EXPECT_THAT(names(e), ElementsAre());
  ASSERT_FALSE(e.unknown.empty());
  EXPECT_EQ(e.unknown[0].covariate, "supply_voltage_V");
}

/// Names are tried before curves: the wind goes with what nobody has a name for.
TEST_F(Prior, ANameIsTakenBackWhereACurveShowsThatItStoodForAnother) {
  Observations o = observations();
  test::add_covariate(o, "humidity_of_paper", -1, 1, random);
  const VectorXd paper = o.find("humidity_of_paper")->value;
  VectorXd wind(o.rows());
  for (Index row = 0; row < o.rows(); ++row)
    wind(row) = std::sqrt(4 + paper(row) + std::normal_distribution<double>(0, 0.5)(random));
  o.covariates.push_back({"tunnel_airspeed_m_s", wind});
  test::set_y(o, o.y.colwise() + VectorXd(0.01 * paper));
  const Explanation e = explained(o);
  EXPECT_THAT(e.rounds.at(0).outcome, testing::HasSubstr("accepted axial_wind"));
  EXPECT_THAT(names(e), ElementsAre());
  ASSERT_EQ(e.unknown.size(), 1u);
  EXPECT_EQ(e.unknown[0].covariate, "humidity_of_paper");
}

/// What two waves have found.
TEST_F(Prior, ACurveHasAsManyColumnsAsItNeeds) {
  Observations o = observations();
  test::add_covariate(o, "humidity_of_paper", -1, 1, random);
  test::set_y(o, o.y.colwise() + VectorXd(0.01 * o.find("humidity_of_paper")->value));
  const Explanation e = explained(o);
  ASSERT_EQ(e.model.curves.size(), 1u);
  EXPECT_EQ(e.model.curves[0].columns.size(), 1u) << "a straight line";
}

/// The same with twice theory's exponent, for which there is no theory.
TEST_F(Prior, ACoefficientThatTheoryRefusesIsNoLikelier) {
  constexpr int kCampaigns = 12;
  int clipped = 0;
  for (int campaign = 0; campaign < kCampaigns; ++campaign) {
    const auto found = names(explained(with_clipping(2, 8)));
    clipped += !found.empty() && found[0] == "adc_clipping" ? 1 : 0;
  }
  EXPECT_GE(clipped, kCampaigns * 2 / 3);
}

}  // namespace
}  // namespace tunnelrig
