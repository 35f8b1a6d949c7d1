// A condition that some rows lack is no candidate; what it does must not get another's name.
#include "analysis/residual/explanation/explanation_output.h"
#include "analysis/residual/tables.h"

#include <cmath>

#include <gmock/gmock.h>

namespace tunnelrig {
namespace {

using test::explained;
using test::TablesTest;
using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;
using testing::Not;

struct IncompleteConditions : TablesTest {
  /// 14 days of eight thrusts. A battery sags through the day, and one reading of it in `every` is missing.
  Observations thrusts(double exponent, double drift_N_h, const std::string& blocks = "day", int every = 10,
                       double sag_V_h = 0.35, double noise_V = 0.15) {
    std::string csv = "day,h,V,y\n";
    for (int r = 0; r < 112; ++r) {
      const double hours = 0.5 * (r % 8), volts = 16 - sag_V_h * hours + noise_V * scatter(random);
      const double force_N = 8 * std::pow(volts / 15, exponent) + drift_N_h * hours;
      csv += fmt::format("{},{},{},{}\n", r / 8, hours, r % every == 1 ? "" : fmt::format("{}", volts),
                         force_N * (1 + 0.002 * scatter(random)));
    }
    return observed(csv,
                    "blocks = \"" + blocks +
                        "\"\n[response]\ncolumn = \"y\"\nunit = \"N\"\nmeaning = \"thrust_N\"\n"
                        "[[covariates]]\ncolumn = \"h\"\nunit = \"h\"\nmeaning = \"hours_in_session\"\n"
                        "[[covariates]]\ncolumn = \"V\"\nunit = \"V\"\nmeaning = \"supply_voltage_V\"\n");
  }
};

TEST_F(IncompleteConditions, WhatTheyDoGetsNoOthersName) {
  const Explanation e = explained(thrusts(1, 0));
  EXPECT_EQ(names(e), "") << explanation_text(e);
  EXPECT_EQ(e.verdict, "unknown");
  EXPECT_THAT(e.warnings,
              Contains(AllOf(HasSubstr("100 of 112 rows"), HasSubstr("supply_voltage is found"))));
  EXPECT_THAT(e.untestable, Contains(testing::Field(&Untestable::effect, "supply_voltage")));
}

TEST_F(IncompleteConditions, WhatOthersDoKeepsItsName) {
  const Explanation e = explained(thrusts(0, 0.06));
  EXPECT_EQ(names(e), "zero_drift_time ") << explanation_text(e);
  EXPECT_THAT(e.warnings, Not(Contains(HasSubstr("fill in"))));
}

/// A battery that goes its own way, of which one cell is empty: nothing else would tell.
TEST_F(IncompleteConditions, WhatNothingElseShowsIsUnknown) {
  const Explanation e = explained(thrusts(1.5, 0, "day", 1000, 0, 0.5));
  EXPECT_EQ(e.verdict, "unknown") << explanation_text(e);
  ASSERT_EQ(e.unknown.size(), 1U);
  EXPECT_EQ(e.unknown[0].covariate, "supply_voltage_V");
  EXPECT_THAT(e.warnings,
              Contains(AllOf(HasSubstr("111 of 112 rows"), HasSubstr("supply_voltage is found"))));
}

TEST_F(IncompleteConditions, WithoutEffectSayNothing) {
  const Explanation e = explained(thrusts(0, 0, "day", 1000));
  EXPECT_EQ(e.verdict, "no_structure") << explanation_text(e);
  EXPECT_THAT(e.warnings, Not(Contains(HasSubstr("fill in"))));
}

/// Half of it missing leaves enough to see that no cell drifts.
TEST_F(IncompleteConditions, OfHalfTheRunsAreAskedAsWell) {
  const Explanation e = explained(thrusts(1, 0, "day", 2));
  EXPECT_EQ(names(e), "") << explanation_text(e);
  EXPECT_THAT(e.warnings, Contains(HasSubstr("supply_voltage is found")));
}

/// A missing cell is a block that is missing, where rows stand for themselves.
TEST_F(IncompleteConditions, OfRowsThatStandForThemselvesAsWell) {
  const Explanation e = explained(thrusts(1, 0, "rows"));
  EXPECT_EQ(names(e), "") << explanation_text(e);
  EXPECT_THAT(e.warnings,
              Contains(AllOf(HasSubstr("100 of 112 rows"), HasSubstr("supply_voltage is found"))));
}

/// The days that are held out have no reading, or all readings are of them: the others are asked as ever.
TEST_F(IncompleteConditions, WhatIsHeldOutMayHaveAllOfThem) {
  for (const bool held_out_have_it : {true, false}) {
    std::string csv = "day,V,y\n";
    for (int r = 0; r < 112; ++r) {
      const double volts = 16 + 0.2 * scatter(random), force_N = 8 * (1 + 0.002 * scatter(random));
      const bool known = (r / 8 > 7) == held_out_have_it;
      csv += fmt::format("{},{},{}\n", r / 8, known ? fmt::format("{}", volts) : "", force_N);
    }
    const Explanation e =
        explained(observed(csv,
                           "blocks = \"day\"\nhold_out = \"day > 7\"\n[response]\ncolumn = \"y\"\nunit = "
                           "\"N\"\nmeaning = \"thrust_N\"\n[[covariates]]\ncolumn = \"V\"\nunit = "
                           "\"V\"\nmeaning = \"supply_voltage_V\"\n"));
    EXPECT_NE(e.verdict, "insufficient") << explanation_text(e);
    EXPECT_EQ(names(e), "") << explanation_text(e);
  }
}

}  // namespace
}  // namespace tunnelrig
