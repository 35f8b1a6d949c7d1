// A condition that some rows lack is no candidate; what it does must not get another's name.
#include "analysis/residual/explanation_output.h"
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
  /// 14 days of eight thrusts. A battery sags through the day, and every tenth reading of it is missing.
  Observations thrusts(double exponent, double drift_N_h, const std::string& blocks = "day") {
    std::string csv = "day,h,V,y\n";
    for (int r = 0; r < 112; ++r) {
      const double hours = 0.5 * (r % 8), volts = 16 - 0.35 * hours + 0.15 * scatter(random);
      const double force_N = 8 * std::pow(volts / 15, exponent) + drift_N_h * hours;
      csv += fmt::format("{},{},{},{}\n", r / 8, hours, r % 10 == 3 ? "" : fmt::format("{}", volts),
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
              Contains(AllOf(HasSubstr("101 of 112 rows"), HasSubstr("supply_voltage is found"))));
  EXPECT_THAT(e.untestable, Contains(testing::Field(&Untestable::effect, "supply_voltage")));
}

TEST_F(IncompleteConditions, WhatOthersDoKeepsItsName) {
  const Explanation e = explained(thrusts(0, 0.06));
  EXPECT_EQ(names(e), "zero_drift_time ") << explanation_text(e);
  EXPECT_THAT(e.warnings, Not(Contains(HasSubstr("fill in"))));
}

/// A missing cell is a block that is missing, where rows stand for themselves.
TEST_F(IncompleteConditions, OfRowsThatStandForThemselvesAsWell) {
  const Explanation e = explained(thrusts(1, 0, "rows"));
  EXPECT_EQ(names(e), "") << explanation_text(e);
  EXPECT_THAT(e.warnings,
              Contains(AllOf(HasSubstr("101 of 112 rows"), HasSubstr("supply_voltage is found"))));
}

}  // namespace
}  // namespace tunnelrig
