// What is printed of a table is in the unit that it was converted to, and says so.
#include "analysis/residual/explanation/explanation.h"
#include "analysis/residual/explanation/explanation_output.h"
#include "analysis/residual/observations/observations.h"

#include <algorithm>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

using testing::HasSubstr;
using testing::Not;

const char* const kCells = "y,h,n\n100,10,7000\n102,20,7700\n101,40,6300\n104,30,7000\n";

Observations observed(const std::string& unit, const ObservationChoice& choice = {},
                      const std::string& more = "") {
  const std::string schema = "format = \"tunnelrig-table/1\"\n[response]\ncolumn = \"y\"\nunit = \"" + unit +
                             "\"\n[[covariates]]\ncolumn = \"h\"\nunit = \"mm\"\n" + more;
  return observe_table(read_observations(parse_csv(kCells, "t.csv"), parse_table_schema(schema, "s.toml")),
                       choice);
}

TEST(TableUnits, AResponseIsLabelledByTheUnitItIsConvertedTo) {
  struct Case {
    const char *unit, *converted;
    double first;
  };
  for (const Case& c :
       {Case{"N", "N", 100}, Case{"gf", "N", 0.980665}, Case{"g", "N", 0.980665}, Case{"kgf", "N", 980.665},
        Case{"lbf", "N", 444.8222}, Case{"ozf", "N", 27.80139}, Case{"mN", "N", 0.1}, Case{"%", "1", 1},
        Case{"mV", "V", 0.1}, Case{"W", "W", 100}, Case{"mV/V", "1", 0.1}, Case{"uV/V", "1", 1e-4},
        Case{"V/V", "1", 100}, Case{"K", "°C", -173.15}, Case{"gf/W", "N/W", 0.980665}}) {
    const Observations o = observed(c.unit);
    EXPECT_EQ(o.unit, c.converted) << c.unit;
    EXPECT_NEAR(std::abs(o.value(0, 0)), std::abs(c.first), 1e-6 * std::abs(c.first)) << c.unit;
  }
}

TEST(TableUnits, SoIsACovariate) {
  const Observations o = observed("N");
  const Covariate* height = o.find("h");
  ASSERT_NE(height, nullptr);
  EXPECT_EQ(height->unit, "m");
  EXPECT_NEAR(height->value(0, 0), 0.01, 1e-12);
}

TEST(TableUnits, AColumnAsTheResponseIsConvertedAsTheSchemaSays) {
  const Observations described = observed("N", {.response = "h"});
  EXPECT_EQ(described.unit, "m");
  EXPECT_NEAR(described.value(1, 0), 0.02, 1e-12);
  EXPECT_EQ(described.find("h"), nullptr) << "it would explain itself";
  const Observations plain = observed("N", {.response = "n"});
  EXPECT_EQ(plain.unit, "1");
  EXPECT_NEAR(plain.value(1, 0), 7700, 1e-9);
}

TEST(TableUnits, NoUnitGetsNoBrackets) {
  for (const char* none : {"", "1"}) {
    Explanation explanation;
    explanation.unit = none;
    explanation.verdict = "no_structure";
    EXPECT_THAT(explanation_text(explanation), Not(HasSubstr("[]")));
    EXPECT_THAT(explanation_text(explanation), HasSubstr("held out: before"));
  }
}

TEST(TableUnits, AnElectricalSpeedIsAMechanicalCondition) {
  const Observations o =
      observed("N", {}, "[speed]\ncolumn = \"n\"\nunit = \"rpm\"\nelectrical = true\npole_count = 14\n");
  EXPECT_NEAR(o.find("speed_rpm")->value(0, 0), 1000, 1e-9);
}

TEST(TableUnits, ACrosstalkCoefficientIsOfTheTwoUnits) {
  const std::string loads =
      "[[covariates]]\ncolumn = \"n\"\nunit = \"gf\"\n[[covariates]]\ncolumn = \"k\"\nunit = \"gf\"\n";
  const auto coefficient = [&](const std::string& unit) {
    const std::string schema =
        "format = \"tunnelrig-table/1\"\n[response]\ncolumn = \"y\"\nunit = \"" + unit + "\"\n" + loads;
    const std::string csv = "y,n,k\n100,1,7\n102,2,3\n101,4,4\n104,3,9\n";
    const Observations o =
        observe_table(read_observations(parse_csv(csv, "t.csv"), parse_table_schema(schema, "s.toml")),
                      {.baseline = "linear:n"});
    return TableEffects(o, {}).all.at(0)->parameters.at(0).unit;
  };
  EXPECT_EQ(coefficient("gf"), "1");
  EXPECT_EQ(coefficient("mV"), "V/N");
  EXPECT_EQ(coefficient("mV/V"), "1/N");
}

/// Newtons among the axes are no newtons of the response.
TEST(TableUnits, ACrosstalkCoefficientIsPrintedAsItIs) {
  const auto printed = [](const std::string& load_unit) {
    const std::string schema =
        "format = \"tunnelrig-table/1\"\n[response]\ncolumn = \"y\"\nunit = \"counts\"\n"
        "[[covariates]]\ncolumn = \"n\"\nunit = \"N\"\n[[covariates]]\ncolumn = \"k\"\nunit = \"" +
        load_unit + "\"\n";
    const Observations o =
        observe_table(read_observations(parse_csv("y,n,k\n100,1,7\n102,2,3\n101,4,4\n", "t.csv"),
                                        parse_table_schema(schema, "s.toml")),
                      {.baseline = "linear:n"});
    return unit_of(o, *TableEffects(o, {}).all.at(0), 0);
  };
  EXPECT_EQ(printed("N"), "1/N");
  EXPECT_EQ(printed("N·m"), "1/(N·m)");
}

/// Of loads that hardly differ any slope is possible, but no cell that reads less the more it is loaded.
TEST(TableUnits, ACellBendsByATenthAtMost) {
  const auto most_bent = [](const std::string& csv, const std::string& baseline) {
    const std::string schema =
        "format = \"tunnelrig-table/1\"\n[response]\ncolumn = \"y\"\nunit = \"N\"\n"
        "[[covariates]]\ncolumn = \"n\"\nunit = \"N\"\n";
    const Observations o =
        observe_table(read_observations(parse_csv(csv, "t.csv"), parse_table_schema(schema, "s.toml")),
                      {.baseline = baseline});
    std::vector<const Effect*> every;
    for (const Effect& effect : all_effects()) every.push_back(&effect);
    const TableEffects effects(o, every);
    const auto bent = std::ranges::find(effects.all, std::string("nonlinearity"),
                                        [](const Effect* effect) { return effect->name; });
    return (*bent)->parameters[0].upper;
  };
  const std::string csv = "y,n\n3.0,1\n3.1,2\n3.2,4\n";
  EXPECT_NEAR(most_bent(csv, ""), 0.1 / 3.2, 1e-9);
  EXPECT_NEAR(most_bent(csv, "linear:n"), 0.1 / 0.2, 1e-9) << "3 N without a load";
}

}  // namespace
}  // namespace tunnelrig
