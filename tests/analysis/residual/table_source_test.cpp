// Which rows of a table are explained, and as what.
#include "analysis/residual/explanation/explanation_output.h"
#include "analysis/residual/tables.h"
#include "datasets/error.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>

#include <fmt/format.h>
#include <gmock/gmock.h>

namespace tunnelrig {
namespace {

using test::effect_named;
using test::explained;
using test::TablesTest;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

struct TableSourceTest : TablesTest {
  static constexpr const char* kThrustAndSpeed =
      "blocks = \"b\"\n[response]\ncolumn = \"y\"\nunit = \"N\"\nmeaning = \"thrust_N\"\n"
      "[speed]\ncolumn = \"N\"\nunit = \"rpm\"\n";
  static constexpr const char* kPropeller = "[propeller]\ndiameter_m = 0.2\n";

  /// Thrust that goes with the speed to the power of 2.15, twelve days.
  std::string thrusts() {
    std::string csv = "b,N,y\n";
    for (int r = 0; r < 96; ++r) {
      const double rpm = 3000 + 4000 * even(random);
      csv += fmt::format("{},{},{}\n", r / 8, rpm,
                         6 * std::pow(rpm / 5000, 2.15) * (1 + 0.003 * scatter(random)));
    }
    return csv;
  }
};

/// Without a diameter there is no C_T: what the speed does is there to be found.
TEST_F(TableSourceTest, AThrustOverSpeedWithoutAPropellerGoesWithTheSpeed) {
  const Observations o = observed(thrusts(), kThrustAndSpeed);
  EXPECT_FALSE(o.coefficient);
  EXPECT_EQ(names(explained(o)), "rotor_speed reynolds_number ");
}

TEST_F(TableSourceTest, WithOneItIsExplainedAsC_T) {
  const Observations o = observed(thrusts(), std::string(kThrustAndSpeed) + kPropeller);
  EXPECT_TRUE(o.coefficient);
  const Explanation e = explained(o);
  EXPECT_EQ(names(e), "reynolds_number ");
  EXPECT_NEAR(e.adopted[0].parameters[0].value, 0.15, 0.02);
}

/// A day whose tachometer never locked, a cell that was left empty, a motor that stood.
TEST_F(TableSourceTest, RowsWithoutASpeedHaveNoC_TAndAreSaid) {
  std::string csv = thrusts();
  for (int r = 0; r < 9; ++r) csv += fmt::format("dark,0,{}\n", 3 + 0.1 * r);
  csv += "3,,5\n4,10,0.01\n";
  const std::string schema = "groups = [\"b\"]\n" + std::string(kThrustAndSpeed);
  const Observations o = observed(csv, schema + kPropeller);
  EXPECT_EQ(o.rows(), 96);
  EXPECT_TRUE(o.multiplicative);
  EXPECT_THAT(o.left_out,
              ElementsAre("1 row left out: the motor stood or its speed was not read (at most 5 % of what "
                          "its group runs at), t.csv:108",
                          "10 rows left out: no speed was read, so there is no C_T, t.csv:98, t.csv:99, "
                          "t.csv:100, t.csv:101 and 6 more"));
  EXPECT_EQ(observed(csv, schema).rows(), 105)
      << "a day without speeds has its thrusts; one empty cell is left out";
}

/// The others do not rest because one reading is forty times theirs.
TEST_F(TableSourceTest, AWildSpeedReadingIsOneRow) {
  const std::string schema = "groups = [\"b\"]\n" + std::string(kThrustAndSpeed);
  const Observations o = observed(thrusts() + "3,200000,5\n", schema + kPropeller);
  EXPECT_EQ(o.rows(), 97);
  const Explanation e = explained(o);
  ASSERT_EQ(e.suspect_rows.size(), 1u);
  EXPECT_EQ(e.suspect_rows[0].row, "t.csv:98");
  EXPECT_EQ(names(e), "reynolds_number ");
}

/// A cell's own faults, by how much larger they are beside small (or large) thrusts.
TEST_F(TableSourceTest, AZeroThatWasNotTakenOffAndACellThatBendsAreFoundInThrusts) {
  const auto with = [&](double zero_N, double bent_per_N) {
    std::string csv = "b,N,y\n";
    for (int r = 0; r < 96; ++r) {
      const double rpm = 3000 + 4000 * even(random), force_N = 6 * std::pow(rpm / 5000, 2);
      csv += fmt::format("{},{},{}\n", r / 8, rpm,
                         (force_N * (1 + bent_per_N * force_N) + zero_N) * (1 + 0.002 * scatter(random)));
    }
    return csv;
  };
  for (const std::string propeller : {"", kPropeller}) {
    const Explanation e = explained(observed(with(0.06, 0), kThrustAndSpeed + propeller));
    ASSERT_EQ(names(e), propeller.empty() ? "rotor_speed zero_offset " : "zero_offset ");
    EXPECT_NEAR(e.adopted.back().parameters[0].value, 0.06, 0.01);
  }
  const Explanation bent = explained(observed(with(0, 0.006), kThrustAndSpeed));
  ASSERT_EQ(bent.adopted.size(), 2u);
  std::vector<std::string> set = bent.adopted[1].confounded_with;
  set.push_back(bent.adopted[1].term.effect->name);
  EXPECT_THAT(set, Contains("nonlinearity"));
}

TEST_F(TableSourceTest, RowsThatStandTwiceAreSaid) {
  std::string csv = thrusts();
  EXPECT_THAT(observed(csv, kThrustAndSpeed).left_out, testing::IsEmpty());
  csv += csv.substr(csv.find('\n') + 1);
  EXPECT_THAT(observed(csv, kThrustAndSpeed).left_out,
              ElementsAre(HasSubstr("96 rows are the same in every column as another")));
}

TEST_F(TableSourceTest, AFewRowsWithoutASpeedAreLeftOut) {
  std::string csv = thrusts();
  for (int row = 0; row < 3; ++row) csv += fmt::format("1,,{}\n", 5 + row);
  const Observations o = observed(csv, kThrustAndSpeed);
  EXPECT_EQ(o.rows(), 96);
  EXPECT_THAT(o.left_out, ElementsAre(HasSubstr("3 rows left out: no speed was read, as in all others")));
  EXPECT_FALSE(o.not_usable.contains("speed_rpm"));
}

/// So large that small thrusts have the other sign: it is the baseline's then, and said.
TEST_F(TableSourceTest, ThrustsOfBothSignsHaveATareBesideTheirC_T) {
  const auto with = [&](double tare_N) {
    std::string csv = "b,N,y\n";
    for (int r = 0; r < 96; ++r) {
      const double rpm = 1000 + 6000 * even(random);
      csv += fmt::format("{},{},{}\n", r / 8, rpm,
                         6 * std::pow(rpm / 5000, 2) + tare_N + 0.01 * scatter(random));
    }
    return csv;
  };
  for (const std::string propeller : {"", kPropeller}) {
    const Explanation e = explained(observed(with(-1.5), kThrustAndSpeed + propeller));
    EXPECT_EQ(e.verdict, "no_structure") << explanation_text(e);
    EXPECT_LT(e.after.held_out_rmse, 0.02);
    EXPECT_THAT(e.warnings, Contains(HasSubstr("a constant beside C_T, -1.5")));
  }
  std::string alike = kThrustAndSpeed;
  alike.insert(alike.find("unit"), "scatter = \"absolute\"\n");
  EXPECT_THAT(explained(observed(with(0), alike)).warnings,
              Not(Contains(HasSubstr("a constant beside C_T"))));
}

/// A tachometer does not see the direction. In reverse the blades give a quarter less.
TEST_F(TableSourceTest, ThrustsOfBothDirectionsAreOfASpeedWithTheirSign) {
  std::string csv = "b,N,y\n";
  for (int r = 0; r < 96; ++r) {
    const double rpm = 1000 + 6000 * even(random), full_N = 6 * std::pow(rpm / 5000, 2);
    csv += fmt::format("{},{},{}\n", r / 8, rpm,
                       (r % 2 == 0 ? full_N : -0.75 * full_N) + 0.02 * scatter(random));
  }
  const Explanation e = explained(observed(csv, kThrustAndSpeed));
  EXPECT_THAT(e.warnings, Contains(HasSubstr("thrusts of both directions")));
  EXPECT_THAT(e.warnings, Not(Contains(HasSubstr("a tare that was not taken off"))));
  ASSERT_EQ(names(e), "bidirectional ") << explanation_text(e);
  EXPECT_NEAR(e.adopted[0].parameters[0].value, -0.25, 0.02);
  EXPECT_LT(e.after.held_out_rmse, 2 * 0.02) << "about what the rows scatter by";
}

/// The density that C_T is made with has the pressure; it is not sought again.
TEST_F(TableSourceTest, RowsWithoutAirHaveNoC_TAndItsPressureIsNotSoughtAgain) {
  std::string csv = "b,N,T,p,y\n";
  for (int r = 0; r < 96; ++r) {
    const double celsius = 15 + 10 * even(random), hPa = 990 + 30 * even(random);
    csv += fmt::format("{},5000,{},{},{}\n", r / 8, r == 7 ? "" : fmt::format("{}", celsius), hPa,
                       6 * hPa / 1013 * 288 / (celsius + 273) * (1 + 0.001 * scatter(random)));
  }
  const std::string schema =
      std::string(kThrustAndSpeed) + kPropeller +
      "[[covariates]]\ncolumn = \"T\"\nunit = \"degC\"\nmeaning = \"air_temperature_C\"\n"
      "[[covariates]]\ncolumn = \"p\"\nunit = \"hPa\"\nmeaning = \"air_pressure_Pa\"\n";
  const Observations o = observed(csv, schema);
  EXPECT_EQ(o.rows(), 95);
  EXPECT_THAT(o.left_out,
              ElementsAre(HasSubstr("1 row left out: the temperature or the pressure of the air is empty")));
  EXPECT_THAT(testability(effect_named("air_pressure"), o).reason, HasSubstr("density"));
  EXPECT_EQ(explained(o).verdict, "no_structure");
  EXPECT_EQ(observed(csv, schema, "constant").rows(), 95)
      << "what is the default is the same when it is said";
}

/// The air was noted once, where the motor stood.
TEST_F(TableSourceTest, WhereNoRowIsLeftTheReasonsAreSaid) {
  std::string csv = "b,N,T,y\n0,10,20,0.01\n";
  for (int r = 0; r < 24; ++r) csv += fmt::format("{},5000,,{}\n", r / 4, 6 + 0.1 * even(random));
  const std::string schema = std::string(kThrustAndSpeed) + kPropeller +
                             "[[covariates]]\ncolumn = \"T\"\nunit = \"degC\"\nmeaning = "
                             "\"air_temperature_C\"\n";
  for (const std::string groups : {"", "groups = [\"b\"]\n"}) {
    try {
      observed(csv, groups + schema);
      ADD_FAILURE() << "explained without a row";
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr("no row is left to explain: 1 row left out: the motor stood"));
      EXPECT_THAT(error.what(), HasSubstr("the temperature or the pressure of the air is empty"));
    }
  }
}

/// Of a cell for forces and moments: both load it.
TEST_F(TableSourceTest, AForceLeaksIntoAMoment) {
  std::string csv = "series,fy,mx,y\n";
  for (const char* series : {"fy", "mx"})
    for (const double load : {0.0, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 10.0}) {
      const double fy = series[0] == 'f' ? load : 0, mx = series[0] == 'm' ? 0.15 * load : 0;
      csv += fmt::format("{},{},{},{}\n", series, fy, mx, mx - 0.02 * fy + 0.001 * scatter(random));
    }
  const Observations o = observed(csv,
                                  "groups = [\"series\"]\n[response]\ncolumn = \"y\"\nunit = \"N m\"\n"
                                  "[[covariates]]\ncolumn = \"fy\"\nunit = \"N\"\n"
                                  "[[covariates]]\ncolumn = \"mx\"\nunit = \"N m\"\n",
                                  "linear:mx");
  EXPECT_THAT(o.other_axes, ElementsAre("fy"));
  const TableEffects effects(o, test::every_effect());
  const Explanation e = explain(o, effects.all, test::quick());
  EXPECT_EQ(names(e), "crosstalk ");
  EXPECT_NEAR(e.adopted[0].parameters[0].value, -0.02, 0.002);
  EXPECT_EQ(effects.all.back()->parameters[0].unit, "N·m/N");
}

/// As large as each other, so that beside one that is not in the model the other is no more than scatter.
TEST_F(TableSourceTest, TwoAxesThatHideEachOtherAreBothFound) {
  std::string csv = "axis,fx,fy,fz,y\n", schema = "groups = [\"axis\"]\n";
  for (const char axis : {'x', 'y', 'z'}) {
    for (const double load : {0.0, 1.5, 3.0, 6.0, 9.0}) {
      const double fx = axis == 'x' ? load : 0, fy = axis == 'y' ? load : 0, fz = axis == 'z' ? load : 0;
      csv += fmt::format("{},{},{},{},{}\n", axis, fx, fy, fz,
                         fy + 0.02 * fx - 0.02 * fz + 0.001 * scatter(random));
    }
  }
  schema += "[response]\ncolumn = \"y\"\nunit = \"V\"\n";
  for (const char axis : {'x', 'y', 'z'})
    schema += fmt::format("[[covariates]]\ncolumn = \"f{}\"\nunit = \"N\"\n", axis);
  const Observations o = observed(csv, schema, "linear:fy");
  const TableEffects effects(o, test::every_effect());
  const Explanation e = explain(o, effects.all, test::quick());
  ASSERT_EQ(names(e), "crosstalk crosstalk ");
  for (const AdoptedEffect& adopted : e.adopted)
    EXPECT_NEAR(adopted.parameters[0].value, adopted.term.effect->form == "fx" ? 0.02 : -0.02, 0.001);
  EXPECT_LT(e.after.held_out_rmse, 0.1 * e.before.held_out_rmse);
}

/// A cell of six axes, loaded at arms of its mounts: what loads fx are read as, and what the others leak.
struct SixAxesTest : TableSourceTest {
  struct Mount {
    int axis;                    // what is loaded
    std::map<int, double> arms;  // of the moments that come with it, m
  };
  static constexpr std::array kAxes = {"fx", "fy", "fz", "mx", "my", "mz"};
  static constexpr std::array kLeaks = {1., 0.02, 0.01, 0.12, 0.25, -0.02};

  /// A column "mount", the loads, and a reading y of scatter 0.02 N, with a zero of each mount's own.
  std::string readings(const std::vector<Mount>& mounts, double zero_scatter_N) {
    std::string csv = "mount,fx,fy,fz,mx,my,mz,y\n";
    for (std::size_t m = 0; m < mounts.size(); ++m) {
      const double zero_N = zero_scatter_N * scatter(random);
      for (const double load : {0.0, 0.6, 1.4, 2.8, 3.9, 6.7, 11.3, 15.9, 21.7}) {
        double reading = zero_N + 0.02 * scatter(random);
        csv += fmt::format("m{}", m);
        for (int axis = 0; axis < 6; ++axis) {
          const auto arm = mounts[m].arms.find(axis);
          const double applied = axis == mounts[m].axis        ? load
                                 : arm != mounts[m].arms.end() ? arm->second * load
                                                               : 0;
          reading += kLeaks[static_cast<std::size_t>(axis)] * applied;
          csv += fmt::format(",{}", applied);
        }
        csv += fmt::format(",{}\n", reading);
      }
    }
    return csv;
  }

  static std::string schema_of(std::string schema) {
    schema += "[response]\ncolumn = \"y\"\nunit = \"N\"\n";
    for (const std::string axis : kAxes)
      schema +=
          fmt::format("[[covariates]]\ncolumn = \"{}\"\nunit = \"{}\"\n", axis, axis[0] == 'f' ? "N" : "N m");
    return schema;
  }

  static void expect_the_four_largest(const Observations& o) {
    const TableEffects effects(o, test::every_effect());
    const Explanation e = explain(o, effects.all, test::quick());
    ASSERT_EQ(names(e), "crosstalk crosstalk crosstalk crosstalk ") << explanation_text(e);
    for (const AdoptedEffect& adopted : e.adopted) {
      const auto axis = std::find(kAxes.begin(), kAxes.end(), adopted.term.effect->form) - kAxes.begin();
      const double leak = kLeaks[static_cast<std::size_t>(axis)];
      EXPECT_NEAR(adopted.parameters[0].value, leak, 0.004 + 0.1 * leak)
          << kAxes[static_cast<std::size_t>(axis)];
    }
  }
};

/// Five axes leak in, and hide each other.
TEST_F(SixAxesTest, ManyAxesThatHideEachOtherAreAllFound) {
  const std::vector<Mount> once = {{1, {}}, {1, {{3, -0.15}}}, {0, {}},          {0, {{4, 0.15}}},
                                   {2, {}}, {2, {{3, 0.12}}},  {2, {{4, -0.12}}}};
  std::vector<Mount> mounts = once;
  mounts.insert(mounts.end(), once.begin(), once.end());
  expect_the_four_largest(observed(readings(mounts, 0.3), schema_of("groups = [\"mount\"]\n"), "linear:fx"));
}

/// fx at an arm loads mz as much as fy loads nothing else: taken together at the first look, one may stand
/// for another, and is named when it is seen alone.
TEST_F(SixAxesTest, AxesThatMayStandForEachOtherAreNotTakenTogether) {
  expect_the_four_largest(observed(readings({{1, {}},
                                             {1, {{3, -0.15}}},
                                             {0, {}},
                                             {0, {{4, 0.15}}},
                                             {0, {{5, -0.1}}},
                                             {2, {}},
                                             {2, {{3, 0.12}}},
                                             {2, {{4, -0.12}}}},
                                            0),
                                   schema_of("blocks = \"mount\"\n"), "linear:fx"));
}

/// A C_T that goes with the tip's Mach number, propellers of two sizes in one table.
TEST_F(TableSourceTest, EveryRowHasTheTipOfItsOwnPropeller) {
  std::string csv = "b,prop,D,N,T,y\n";
  for (int r = 0; r < 144; ++r) {
    const bool large = r % 2 == 0;
    const double diameter_m = large ? 0.6 : 0.127, rpm = (large ? 4000 : 20000) * (0.5 + 1.2 * even(random));
    const double celsius = 10 + 20 * even(random);
    const double mach =
        rpm * std::numbers::pi / 60 * diameter_m / std::sqrt(1.4 * 287.05 * (celsius + 273.15));
    csv += fmt::format("{},{},{},{},{},{}\n", r / 12, large ? "large" : "small", diameter_m, rpm, celsius,
                       0.1 * std::pow(1 - mach * mach, -0.5) * (1 + 0.0005 * scatter(random)));
  }
  const std::string schema =
      "groups = [\"prop\"]\nblocks = \"b\"\n[response]\ncolumn = \"y\"\nunit = \"1\"\nmeaning = "
      "\"c_t_propeller\"\n"
      "[speed]\ncolumn = \"N\"\nunit = \"rpm\"\n[[covariates]]\ncolumn = \"T\"\nunit = \"degC\"\nmeaning = "
      "\"air_temperature_C\"\n";
  const Explanation e =
      explained(observed(csv, schema + "[propeller]\ndiameter_column = \"D\"\ndiameter_unit = \"m\"\n"));
  ASSERT_EQ(names(e), "tip_mach ") << explanation_text(e);
  EXPECT_NEAR(e.adopted[0].parameters[0].value, 0.5, 0.02);
  EXPECT_THAT(testability(effect_named("tip_mach"), observed(csv, schema)).missing,
              ElementsAre("propeller_diameter_m"));
}

/// Readings of one sign, whichever it is: the run that would tell two names apart is the same.
TEST_F(TableSourceTest, TheSeparatingRunIsThatOfTheMagnitudes) {
  std::string up = "b,g,N,T,y\n", down = up;
  for (int r = 0; r < 96; ++r) {
    const double rpm = 4800 + 400 * even(random), celsius = 20 + 0.02 * scatter(random);
    const double c_t = 0.1 * std::pow(rpm / 5000, 0.4) * (1 + 0.002 * scatter(random));
    const std::string row = fmt::format("{},{},{},{},", r / 8, r % 2 == 0 ? "p" : "q", rpm, celsius);
    up += row + fmt::format("{}\n", c_t);
    down += row + fmt::format("{}\n", -c_t);
  }
  const std::string schema =
      "groups = [\"g\"]\nblocks = \"b\"\n[response]\ncolumn = \"y\"\nunit = \"1\"\nmeaning = "
      "\"c_t_propeller\"\n"
      "[speed]\ncolumn = \"N\"\nunit = \"rpm\"\n[[covariates]]\ncolumn = \"T\"\nunit = \"degC\"\nmeaning = "
      "\"air_temperature_C\"\n";
  const Explanation plus = explained(observed(up, schema)), minus = explained(observed(down, schema));
  ASSERT_EQ(plus.verdict, "confounded") << explanation_text(plus);
  ASSERT_TRUE(plus.adopted[0].separating_run.has_value());
  ASSERT_TRUE(minus.adopted[0].separating_run.has_value());
  EXPECT_EQ(plus.adopted[0].separating_run->text, minus.adopted[0].separating_run->text);
}

/// One zero among voltages that are no zero elsewhere: a power of it is no number.
TEST_F(TableSourceTest, WhereAnEffectHasNoValueIsSaid) {
  std::string csv = "b,V,y\n";
  for (int r = 0; r < 96; ++r) {
    const double volts = 10 + 2 * even(random);
    csv +=
        fmt::format("{},{},{}\n", r / 8, r == 50 ? 0 : volts, 8 * volts / 11 * (1 + 0.003 * scatter(random)));
  }
  const Explanation e =
      explained(observed(csv,
                         "blocks = \"b\"\n[response]\ncolumn = \"y\"\nunit = \"N\"\nmeaning = \"thrust_N\"\n"
                         "[[covariates]]\ncolumn = \"V\"\nunit = \"V\"\nmeaning = \"supply_voltage_V\"\n"));
  EXPECT_THAT(e.warnings, Contains(HasSubstr("supply_voltage is not tried: it has no value in t.csv:52")));
  EXPECT_NE(e.verdict, "no_structure");
}

TEST_F(TableSourceTest, AResponseWhoseSquaresAreNoNumbersIsRefused) {
  try {
    observed("x,y\n1,2\n2,3e120\n", "[response]\ncolumn = \"y\"\nunit = \"N\"\n");
    ADD_FAILURE();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("t.csv:3: the response y is 3e+120"));
  }
}

/// What hold_out leaves must be enough to search, and the baseline must leave something to it.
TEST_F(TableSourceTest, TooLittleIsInsufficient) {
  std::string csv = "b,g,x,y\n";
  for (int r = 0; r < 96; ++r)
    csv += fmt::format("{},{},{},{}\n", r / 8, r % 48, even(random), 5 + 0.1 * scatter(random));
  const std::string response = "[response]\ncolumn = \"y\"\nunit = \"N\"\n";
  Explanation e = explained(observed(csv, "blocks = \"b\"\nhold_out = \"b > 0\"\n" + response));
  EXPECT_EQ(e.verdict, "insufficient");
  EXPECT_THAT(e.warnings, Contains(HasSubstr("hold_out leaves 1 block")));
  e = explained(observed(csv, "groups = [\"g\"]\nblocks = \"b\"\nhold_out = \"b > 5\"\n" + response));
  EXPECT_EQ(e.verdict, "insufficient");
  EXPECT_THAT(e.warnings, Contains(HasSubstr("nothing is left to explain")));
}

}  // namespace
}  // namespace tunnelrig
