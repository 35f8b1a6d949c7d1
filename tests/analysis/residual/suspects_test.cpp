// Runs whose conditions were mistyped.
#include "analysis/residual/explanation_output.h"
#include "analysis/residual/explanation_parts.h"
#include "analysis/residual/simulated.h"
#include "support/seeds.h"

#include <limits>
#include <stdexcept>

#include <gmock/gmock.h>

namespace tunnelrig {
namespace {

using testing::Contains;
using testing::HasSubstr;

struct Mistyped : testing::Test {
  std::mt19937_64 random{test::seed()};
  Observations campaign = with_supply();

  /// A supply voltage does 1 % a volt.
  Observations with_supply() {
    Observations o = test::four_rotors(4, 0.002, random);
    const Covariate& volts = *o.find("supply_voltage_V");
    test::set_y(o, o.y.colwise() + 0.01 * (volts.value.col(0).array() - 16).matrix());
    return o;
  }
  double& volts(Eigen::Index run) {
    for (Covariate& covariate : campaign.covariates)
      if (covariate.name == "supply_voltage_V") return covariate.value(run, 0);
    throw std::logic_error("no supply");
  }
};

TEST_F(Mistyped, AConditionIsSetAsideAndHidesNothing) {
  volts(70) = 1.6;
  const Explanation e = test::explained(campaign);
  ASSERT_EQ(e.adopted.size(), 1u) << explanation_text(e);
  EXPECT_EQ(e.adopted[0].term.effect->name, "supply_voltage");
  ASSERT_EQ(e.suspect_rows.size(), 1u);
  EXPECT_EQ(e.suspect_rows[0].row, campaign.name[70]);
  EXPECT_TRUE(e.suspect_rows[0].set_aside);
  EXPECT_THAT(e.warnings,
              Contains(HasSubstr("supply_voltage_V of " + campaign.name[70] + " is 1.6, far from")));
}

TEST_F(Mistyped, ATemperatureIsASlipWhereTheDensityPutTheThrustFarOff) {
  test::add_covariate(campaign, "air_temperature_C", 18, 24, random);
  campaign.covariates.back().value(70, 0) = 4;
  EXPECT_TRUE(mistyped_values(campaign).empty()) << "a cold day";
  Eigen::MatrixXd y = campaign.y;
  y.row(70).array() += 0.06;
  test::set_y(campaign, y);
  ASSERT_EQ(mistyped_values(campaign).size(), 1u);
  EXPECT_EQ(mistyped_values(campaign)[0].row, campaign.name[70]);
}

/// The run that would tell two effects apart, as `separating_run` proposes it.
TEST_F(Mistyped, ARunUnderOtherConditionsOnPurposeIsNone) {
  volts(70) = 24;
  Eigen::MatrixXd y = campaign.y;
  y.row(70).array() += 0.08;
  test::set_y(campaign, y);
  EXPECT_TRUE(mistyped_values(campaign).empty());
}

TEST_F(Mistyped, GapsOfADistanceAreNoValues) {
  volts(70) = 1.6;
  for (const Eigen::Index run : {3, 9, 40}) volts(run) = std::numeric_limits<double>::infinity();
  ASSERT_EQ(isolated_values(campaign).size(), 1u);
  EXPECT_GT(isolated_values(campaign)[0].low, 10);
}

}  // namespace
}  // namespace tunnelrig
