// Tables as others bring them: gross rows, a cell's volts, groups that differ, steps and trends.
#include "analysis/residual/tables.h"

#include "analysis/residual/explanation/explanation_output.h"
#include "analysis/residual/likelihood/curves.h"
#include "support/message_of.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

namespace tunnelrig {
namespace {

using test::explained;
using test::kMiddle_V;
using test::TablesTest;
using testing::Contains;
using testing::HasSubstr;

TEST_F(TablesTest, ARowTenTimesTooLargeIsSetAside) {
  const Observations o = thrusts(10);
  const Explanation e = explained(o);
  ASSERT_FALSE(e.suspect_rows.empty());
  EXPECT_EQ(e.suspect_rows[0].row, "t.csv:24");
  EXPECT_TRUE(e.suspect_rows[0].set_aside);
  EXPECT_EQ(e.runs, 95);
  EXPECT_EQ(names(e), "supply_voltage ");
  EXPECT_NEAR(e.adopted[0].parameters[0].value, 1.7, 0.15);
  EXPECT_TRUE(nlohmann::json::parse(explanation_json(e))["suspect_rows"][0]["set_aside"]);
  EXPECT_EQ(e.residual_after.rows(), without_set_aside(o, e).rows());
}

TEST_F(TablesTest, RowsOffByATenthAreAsFarOffEitherWay) {
  for (const double wrong : {1.1, 0.9}) {
    const Explanation e = explained(thrusts(wrong));
    ASSERT_FALSE(e.suspect_rows.empty()) << wrong;
    EXPECT_EQ(e.suspect_rows[0].row, "t.csv:24");
    EXPECT_NEAR(e.suspect_rows[0].studentised, (wrong > 1 ? 1 : -1) * 0.1 / 0.003, 20) << wrong;
  }
}

/// What is straight in a curve over the baseline's own column is the baseline's: only the bend is drawn.
TEST_F(TablesTest, ACurveOverTheBaselinesColumnIsItsBend) {
  constexpr double kBend = 0.03;
  std::string csv = "b,x,y\n";
  for (int r = 0; r < 96; ++r) {
    const double along = even(random);  // of log x, 2 to 8
    const double x = 2 * std::pow(4, along);
    const double bend = kBend * std::cos(2 * std::numbers::pi * along);
    csv += fmt::format("{},{},{}\n", r / 8, x, 10 * std::pow(x, 1.4) * (1 + bend + 0.003 * scatter(random)));
  }
  const std::string schema =
      "blocks = \"b\"\n[response]\ncolumn = \"y\"\nunit = \"W\"\nscatter = \"relative\"\n"
      "[[covariates]]\ncolumn = \"x\"\nunit = \"1\"\n";
  const Observations o = observed(csv, schema, "power:x");
  const Explanation e = explained(o);
  ASSERT_EQ(e.unknown.size(), 1u);
  EXPECT_EQ(e.unknown[0].covariate, "x");
  EXPECT_NEAR(e.unknown[0].amplitude / (kBend * o.value.mean()), 1, 0.3);
}

/// Whether the power law bends or the cell that read it, nobody knows.
TEST_F(TablesTest, ABendBesideThePowerLawHasNoName) {
  for (const bool of_the_cell : {false, true}) {
    std::string csv = "b,rpm,y\n";
    for (int r = 0; r < 160; ++r) {
      const double along = std::fmod(0.618 * r, 1), force = std::pow(4, 1.4 * along);
      const double bend = of_the_cell ? 0.012 * force : 0.03 * std::cos(2 * std::numbers::pi * along);
      csv += fmt::format("{},{},{}\n", r / 10, 2 * std::pow(4, along),
                         10 * force * (1 + bend + 0.01 * scatter(random)));
    }
    const Explanation e = explained(observed(csv,
                                             "blocks = \"b\"\n[response]\ncolumn = \"y\"\nunit = \"N\"\n"
                                             "[[covariates]]\ncolumn = \"rpm\"\nunit = \"1\"\n",
                                             "power:rpm"));
    EXPECT_EQ(names(e), "");
    ASSERT_EQ(e.unknown.size(), 1u);
    EXPECT_EQ(e.unknown[0].covariate, "rpm");
  }
}

TEST_F(TablesTest, RowsThatBelongAreNotSuspect) { EXPECT_TRUE(explained(thrusts(1)).suspect_rows.empty()); }

/// A value ten times too large in a condition bends the model: what predicts worse than nothing is found
/// anew.
TEST_F(TablesTest, AConditionFarFromAllOthersIsSaid) {
  Observations o = thrusts(1);
  o.covariates[0].value(22, 0) *= 10;
  const Explanation e = explained(o);
  EXPECT_THAT(names(e), HasSubstr("supply_voltage"));
  const bool aside =
      !e.suspect_rows.empty() && e.suspect_rows[0].row == "t.csv:24" && e.suspect_rows[0].set_aside;
  if (!aside) {
    EXPECT_THAT(e.warnings, Contains(HasSubstr("of t.csv:24 is")));
  }
  EXPECT_LE(e.after.held_out_rmse, e.before.held_out_rmse);
}

/// A load cell in a chamber: both drifts are straight lines in temperature, told by how they go with the
/// load.
TEST_F(TablesTest, ZeroAndSpanDriftAreBothFound) {
  std::string csv = "b,load,T,u\n";
  for (int block = 0; block < 28; ++block) {
    const double temperature = -10 + 60 * even(random);
    for (int load = 0; load < 6; ++load) {
      const double volts =
          0.2e-3 + 2e-3 * load * (1 - 2.5e-4 * (temperature - 20)) + 4e-6 * (temperature - 20);
      csv += fmt::format("{},{},{},{}\n", block, load, temperature, volts + 3e-6 * scatter(random));
    }
  }
  const Explanation e = explained(
      observed(csv,
               "groups = [\"load\"]\nblocks = \"b\"\n[response]\ncolumn = \"u\"\nunit = \"V\"\n"
               "[[covariates]]\ncolumn = \"T\"\nunit = \"degC\"\nmeaning = \"cell_temperature_C\"\n"));
  ASSERT_EQ(e.adopted.size(), 2u) << names(e);
  for (const AdoptedEffect& adopted : e.adopted) {
    const bool zero = adopted.term.effect->name == "zero_drift_temperature";
    EXPECT_TRUE(zero || adopted.term.effect->name == "span_drift_temperature") << names(e);
    EXPECT_FALSE(adopted.term.per_group);
    EXPECT_NEAR(adopted.parameters[0].value, zero ? 4e-6 : -2.5e-4, zero ? 4e-7 : 2e-5);
  }
  EXPECT_TRUE(std::none_of(e.adopted.begin(), e.adopted.end(), [](const AdoptedEffect& adopted) {
    return adopted.term.effect->name == "temperature_gradient";
  })) << "nobody recorded the air's temperature";
}

/// Rows that drift by themselves, each taken as a block.
TEST_F(TablesTest, RowsThatResembleTheRowBeforeAreWarnedOf) {
  for (const double kept : {0.0, 0.8}) {
    std::string csv = "y\n";
    double drift = 0;
    for (int r = 0; r < 80; ++r) {
      drift = kept * drift + scatter(random);
      csv += fmt::format("{}\n", 100 + drift);
    }
    const Explanation e = explained(observed(csv, "[response]\ncolumn = \"y\"\nunit = \"N\"\n"));
    const auto warned = testing::Contains(HasSubstr("rows resemble the row before them"));
    if (kept > 0)
      EXPECT_THAT(e.warnings, warned);
    else
      EXPECT_THAT(e.warnings, testing::Not(warned));
  }
}

TEST_F(TablesTest, AConditionThatNeverChangesIsWarnedOf) {
  std::string csv = "y,h,own\n";
  for (int r = 0; r < 40; ++r) csv += fmt::format("{},0.4,7\n", 100 + scatter(random));
  const Explanation e = explained(
      observed(csv,
               "[response]\ncolumn = \"y\"\nunit = \"N\"\n[[covariates]]\ncolumn = \"h\"\nunit = \"1\"\n"
               "meaning = \"relative_humidity\"\n[[covariates]]\ncolumn = \"own\"\nunit = \"1\"\n"));
  for (const char* name : {"relative_humidity", "own"})
    EXPECT_THAT(e.warnings, Contains(HasSubstr(std::string(name) + " is the same in every row")));
  EXPECT_TRUE(std::any_of(e.untestable.begin(), e.untestable.end(),
                          [](const Untestable& u) { return u.effect == "air_humidity"; }));
}

/// Thrust at a fixed speed on days of other weather: nothing but the air's density changes.
TEST_F(TablesTest, ThrustInWeatherIsTheAirsDensity) {
  std::string csv = "day,p,T,y\n";
  for (int day = 0; day < 16; ++day) {
    const double p_hPa = 990 + 40 * even(random), T_C = 5 + 25 * even(random);
    for (int r = 0; r < 6; ++r) {
      const double here_C = T_C + even(random), thrust_N = 7 * p_hPa / 1010 * 288 / (here_C + 273.15);
      csv += fmt::format("{},{},{},{}\n", day, p_hPa, here_C, thrust_N * (1 + 0.002 * scatter(random)));
    }
  }
  const Explanation e = explained(
      observed(csv,
               "blocks = \"day\"\n[response]\ncolumn = \"y\"\nunit = \"N\"\nmeaning = \"thrust_N\"\n"
               "[[covariates]]\ncolumn = \"p\"\nunit = \"hPa\"\nmeaning = \"air_pressure_Pa\"\n"
               "[[covariates]]\ncolumn = \"T\"\nunit = \"degC\"\nmeaning = \"air_temperature_C\"\n"));
  ASSERT_EQ(e.adopted.size(), 2u) << names(e);
  for (const AdoptedEffect& adopted : e.adopted) {
    std::vector<std::string> set = adopted.confounded_with;
    set.push_back(adopted.term.effect->name);
    EXPECT_TRUE(std::count(set.begin(), set.end(), "air_pressure") +
                std::count(set.begin(), set.end(), "air_temperature"))
        << names(e);
  }
}

/// A cell that is pulled reads below zero; what its zero does is added all the same.
TEST_F(TablesTest, EffectsAreAddedToNegativeResponsesWithTheirSign) {
  std::string csv = "g,b,T,u\n";
  for (int r = 0; r < 96; ++r) {
    const double temperature = 40 * even(random), load = r % 2 == 0 ? -4 : -8;
    csv += fmt::format("{},{},{},{}\n", r % 2, r / 8, temperature,
                       load * (1 + 0.002 * scatter(random)) + 0.01 * (temperature - 20));
  }
  const Explanation e = explained(
      observed(csv,
               "groups = [\"g\"]\nblocks = \"b\"\n[response]\ncolumn = \"u\"\nunit = \"N\"\n"
               "[[covariates]]\ncolumn = \"T\"\nunit = \"degC\"\nmeaning = \"cell_temperature_C\"\n"));
  ASSERT_EQ(names(e), "zero_drift_temperature ");
  EXPECT_NEAR(e.adopted[0].parameters[0].value, 0.01, 0.001);
}

/// Between two supplies nothing was measured: no wave is laid there.
TEST_F(TablesTest, TextsAreHeldAgainstEachOther) {
  std::string csv = "b,maker,V,y\n";
  for (int r = 0; r < 96; ++r) {
    const bool ours = even(random) < 0.5;
    csv += fmt::format("{},{},{},{}\n", r / 8, ours ? "ours" : "theirs", 10.5 + 2 * even(random),
                       8 * (ours ? 0.99 : 1) * (1 + 0.003 * scatter(random)));
  }
  const std::string schema =
      "blocks = \"b\"\n[response]\ncolumn = \"y\"\nunit = \"N\"\nmeaning = \"thrust_N\"\n"
      "[[covariates]]\ncolumn = \"V\"\nunit = \"V\"\nmeaning = \"supply_voltage_V\"\n";
  const Explanation e =
      explained(observed(csv, schema + "[[covariates]]\ncolumn = \"maker\"\nunit = \"text\"\n"));
  SCOPED_TRACE(explanation_text(e));
  EXPECT_EQ(names(e), "");
  ASSERT_EQ(e.unknown.size(), 1u);
  EXPECT_EQ(e.unknown[0].covariate, "maker");
  EXPECT_THAT(e.unknown[0].labels, testing::ElementsAre("ours", "theirs"));
  EXPECT_NEAR(e.unknown[0].shape[0].y, -0.04, 0.02);
  EXPECT_THAT(test::message_of([&] { observed(csv, schema + "[[covariates]]\ncolumn = \"maker\"\n"); }),
              HasSubstr("maker"));
}

TEST_F(TablesTest, CurvesDoNotSwingInAGap) {
  std::string csv = "b,V,y\n";
  for (int r = 0; r < 96; ++r)
    csv += fmt::format("{},{},{}\n", r / 8, (r % 2 == 0 ? 7.5 : 11.5) + 0.4 * even(random),
                       5 * (1 + 0.003 * scatter(random)));
  const Observations o = observed(csv,
                                  "blocks = \"b\"\n[response]\ncolumn = \"y\"\nunit = \"N\"\n"
                                  "[[covariates]]\ncolumn = \"V\"\nunit = \"V\"\n");
  std::size_t most = 0;
  for (const Curve& curve : curves_to_try(o, o.all_rows()))
    if (curve.covariate == "V") most = std::max(most, curve.columns.size());
  EXPECT_EQ(most, 2u);
}

/// Of few settings a bend alone has no straight course, and levels take up many columns.
TEST_F(TablesTest, FiveSettingsShowAStraightCourse) {
  for (const int settings : {4, 5}) {
    std::string csv = "b,V,y\n";
    for (int r = 0; r < 96; ++r)
      csv += fmt::format("{},{},{}\n", r / 8, 8 + r % settings, 5 * (1 + 0.003 * scatter(random)));
    const Observations o = observed(csv,
                                    "blocks = \"b\"\n[response]\ncolumn = \"y\"\nunit = \"N\"\n"
                                    "[[covariates]]\ncolumn = \"V\"\nunit = \"V\"\n");
    const std::vector<Curve> curves = curves_to_try(o, o.all_rows());
    EXPECT_EQ(std::ranges::any_of(curves,
                                  [](const Curve& curve) {
                                    return curve.covariate == "V" && curve.shape == CurveShape::kWaves;
                                  }),
              settings == 5);
  }
}

}  // namespace
}  // namespace tunnelrig
