// What a table's units, blocks and baseline mean for what is found in it.
#include "analysis/residual/likelihood/testability.h"
#include "analysis/residual/observations/parts_of_equal_size.h"
#include "analysis/residual/tables.h"
#include "support/message_of.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <gmock/gmock.h>

namespace tunnelrig {
namespace {

using test::explained;
using test::TablesTest;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

TEST(PartsOfEqualSize, EqualValuesAreInOnePart) {
  EXPECT_THAT(parts_of_equal_size({4, 1, 3, 2}, 2), ElementsAre(1, 0, 1, 0));
  EXPECT_THAT(parts_of_equal_size({1, 1, 1, 2, 2, 2}, 6), ElementsAre(0, 0, 0, 1, 1, 1));
  EXPECT_THAT(parts_of_equal_size({1, 1, 1, 1, 1, 2, 3, 3}, 3), ElementsAre(0, 0, 0, 0, 0, 1, 2, 2));
  EXPECT_THAT(parts_of_equal_size({5, 5, 5}, 3), ElementsAre(0, 0, 0));
  EXPECT_THAT(parts_of_equal_size({7, 8}, 100), ElementsAre(0, 1));
}

TEST_F(TablesTest, FourSettingsAreFourBlocksHoweverManyBinsAreAskedFor) {
  std::string csv = "throttle,y\n";
  for (int r = 0; r < 80; ++r)
    csv += fmt::format("{},{}\n", 10 * (r % 4), 5 + 0.1 * (r % 4 == 2) + 0.01 * scatter(random));
  const Explanation e =
      explained(observed(csv, "blocks = \"bins(throttle, 20)\"\n[response]\ncolumn = \"y\"\nunit = \"A\"\n"));
  EXPECT_EQ(e.blocks, 4);
  EXPECT_EQ(e.verdict, "insufficient");
}

/// Of a coefficient under another name, and of a power, no theory says that they go with the square.
TEST_F(TablesTest, OnlyForcesGoWithTheSquareOfTheSpeed) {
  std::string csv = "n,V,y\n";
  for (int r = 0; r < 60; ++r) csv += fmt::format("{},12,{}\n", 3000 + 50 * r, 1 + even(random));
  const auto reason = [&](const char* unit, const char* effect) {
    return testability(test::effect_named(effect),
                       observed(csv, fmt::format("[response]\ncolumn = \"y\"\nunit = \"{}\"\n"
                                                 "[speed]\ncolumn = \"n\"\nunit = \"rpm\"\n"
                                                 "[[covariates]]\ncolumn = \"V\"\nunit = \"V\"\n"
                                                 "meaning = \"supply_voltage_V\"\n",
                                                 unit)))
        .reason;
  };
  for (const char* unit : {"N", "N·m", "mV/V", "counts"}) EXPECT_EQ(reason(unit, "rotor_speed"), "") << unit;
  for (const char* unit : {"1", "W", "m/s"})
    EXPECT_THAT(reason(unit, "rotor_speed"), HasSubstr("go with the square")) << unit;
  EXPECT_EQ(reason("N", "supply_voltage"), "supply_voltage_V is the same in every row")
      << "nor when another effect has made the forces vary";
}

/// A number over another number is read by no cell: its constant is a part of what effects act on.
TEST_F(TablesTest, AStraightBaselineIsACellsLineWhereACellIsLoaded) {
  std::string csv = "x,y\n";
  for (int r = 0; r < 40; ++r) csv += fmt::format("{},{}\n", 0.1 + 0.01 * r, 1 + even(random));
  const auto is_line = [&](const char* of_x, const char* of_y) {
    return observed(csv,
                    fmt::format("[response]\ncolumn = \"y\"\nunit = \"{}\"\n"
                                "[[covariates]]\ncolumn = \"x\"\nunit = \"{}\"\n",
                                of_y, of_x),
                    "linear:x")
        .line_of_cell;
  };
  for (const char* of_y : {"1", "mV/V", "counts", "N"}) EXPECT_TRUE(is_line("N", of_y)) << of_y;
  EXPECT_TRUE(is_line("Pa", "V"));
  EXPECT_FALSE(is_line("1", "1")) << "C_P over J";
  EXPECT_FALSE(is_line("rpm", "W"));
}

/// Over the few speeds of one setting an offset of any size would do.
TEST_F(TablesTest, AnOffsetIsNoLargerThanWhatWasRead) {
  const Observations o = thrusts(1);
  const TableEffects effects(o, test::every_effect());
  const auto offset =
      std::ranges::find_if(effects.all, [](const Effect* effect) { return effect->name == "zero_offset"; });
  ASSERT_NE(offset, effects.all.end());
  EXPECT_EQ((*offset)->parameters[0].upper, o.value.maxCoeff());
  EXPECT_EQ((*offset)->parameters[0].lower, -o.value.maxCoeff());
}

/// A power follows the air, a cell's counts its temperature; of a number without a unit neither is known.
TEST_F(TablesTest, ANumberOfWhichNothingIsKnownFollowsNoAir) {
  std::string csv = "T,p,h,y\n";
  for (int r = 0; r < 60; ++r)
    csv += fmt::format("{},{},{},{}\n", 15 + 10 * even(random), 990 + 30 * even(random),
                       100.05 * even(random), 450 + scatter(random));
  const auto reason = [&](const char* unit, const char* effect) {
    const Observations o = observed(csv, fmt::format("[response]\ncolumn = \"y\"\nunit = \"{}\"\n"
                                                     "[[covariates]]\ncolumn = \"T\"\nunit = \"degC\"\n"
                                                     "meaning = \"air_temperature_C\"\n"
                                                     "[[covariates]]\ncolumn = \"p\"\nunit = \"hPa\"\n"
                                                     "meaning = \"air_pressure_Pa\"\n"
                                                     "[[covariates]]\ncolumn = \"h\"\nunit = \"%\"\n"
                                                     "meaning = \"relative_humidity\"\n",
                                                     unit));
    return testability(test::effect_named(effect), o).reason;
  };
  for (const char* effect : {"air_pressure", "air_humidity", "air_temperature"}) {
    EXPECT_EQ(reason("MW", effect), "") << effect;
    EXPECT_THAT(reason("1", effect), HasSubstr("a number without a unit")) << effect;
  }
}

/// Two propellers that the model never saw: every other row gives their constants, the rest are scored.
TEST_F(TablesTest, WholeGroupsCanBeHeldOut) {
  std::string csv = "propeller,V,y\n";
  for (int r = 0; r < 96; ++r) {
    const double volts = 10 + 2 * even(random);
    csv += fmt::format("{},{},{}\n", r % 8, volts,
                       (4 + r % 8) * std::pow(volts / 11, 1.5) * (1 + 0.003 * scatter(random)));
  }
  const std::string schema =
      "groups = [\"propeller\"]\nhold_out = \"propeller > 5\"\n[response]\ncolumn = \"y\"\nunit = \"N\"\n"
      "meaning = \"thrust_N\"\n"
      "[[covariates]]\ncolumn = \"V\"\nunit = \"V\"\nmeaning = \"supply_voltage_V\"\n";
  const Explanation e = explained(observed(csv, schema));
  EXPECT_EQ(names(e), "supply_voltage ");
  EXPECT_THAT(e.warnings, Not(Contains(HasSubstr("not scored"))));
  EXPECT_GT(e.before.held_out_rmse, 0.3);
  EXPECT_GT(e.after.held_out_rmse, 0);
  EXPECT_NEAR(e.after.held_out_rmse / e.noise_floor, 1, 0.5);
}

TEST_F(TablesTest, HeldOutRowsThatStandAloneInTheirGroupsAreRefused) {
  std::string csv = "propeller,y\n";
  for (int r = 0; r < 40; ++r) csv += fmt::format("{},{}\n", r % 4, 5 + 0.01 * scatter(random));
  csv += "7,5.2\n8,5.3\n";
  const Observations o = observed(csv,
                                  "groups = [\"propeller\"]\nhold_out = \"propeller > 5\"\n[response]\n"
                                  "column = \"y\"\nunit = \"N\"\n");
  EXPECT_THAT(test::message_of([&] { explained(o); }), HasSubstr("no row that is held out can be scored"));
}

/// A rate in V/h and an angle in degrees are what the names say, whatever the column's unit.
TEST_F(TablesTest, NamesThatSayAUnitAreKeptInIt) {
  for (const auto& [unit, per_hour] : {std::pair{"h", 1.0}, {"min", 60.0}, {"s", 3600.0}}) {
    const Observations o =
        observed(fmt::format("y,hours_in_session,tilt_deg\n1,{},10\n2,{},20\n", per_hour, 3 * per_hour),
                 fmt::format("[response]\ncolumn = \"y\"\nunit = \"V\"\n[[covariates]]\n"
                             "column = \"hours_in_session\"\nunit = \"{}\"\n[[covariates]]\n"
                             "column = \"tilt_deg\"\nunit = \"deg\"\n",
                             unit));
    EXPECT_NEAR(o.find("hours_in_session")->value(1, 0), 3, 1e-12) << unit;
    EXPECT_EQ(o.find("hours_in_session")->unit, "h");
    EXPECT_NEAR(o.find("tilt_deg")->value(1, 0), 20, 1e-12);
    EXPECT_EQ(o.find("tilt_deg")->unit, "deg");
  }
}

/// What a zero drifts by in counts depends on the converter: bounds in volts say nothing of it.
TEST_F(TablesTest, AZeroThatDriftsInCountsIsNoSpan) {
  std::string csv = "b,T,y\n";
  for (int r = 0; r < 96; ++r) {
    const double temperature = 40 * even(random);
    csv += fmt::format("{},{},{}\n", r / 8, temperature, 30 * (temperature - 20) + 40 * scatter(random));
  }
  const Observations o =
      observed(csv,
               "blocks = \"b\"\n[response]\ncolumn = \"y\"\nunit = \"counts\"\nscatter = \"absolute\"\n"
               "[[covariates]]\ncolumn = \"T\"\nunit = \"degC\"\nmeaning = \"cell_temperature_C\"\n");
  const TableEffects effects(o, test::every_effect());
  const Explanation e = explain(o, effects.all, test::quick());
  ASSERT_EQ(names(e), "zero_drift_temperature ");
  EXPECT_NEAR(e.adopted[0].parameters[0].value, 30, 2);
}

TEST_F(TablesTest, BoundsInVoltsAreForVolts) {
  const auto bound = [&](const std::string& unit) {
    const Observations o = observed("y\n1\n2\n", "[response]\ncolumn = \"y\"\nunit = \"" + unit + "\"\n");
    const TableEffects effects(o, test::every_effect());
    EXPECT_EQ(effects.all.size(), test::every_effect().size());
    for (const Effect* effect : effects.all)
      if (effect->name == "zero_drift_time") return effect->parameters[0].upper;
    return 0.0;
  };
  EXPECT_EQ(bound("V"), test::effect_named("zero_drift_time").parameters[0].upper);
  EXPECT_GT(bound("counts"), 1e6);
}

/// C_T falls with J; what multiplies it multiplies all of it, and not what the line adds to its zero.
TEST_F(TablesTest, AThrustOverAConditionIsAllForce) {
  std::string csv = "rpm,J,CT\n";
  for (int r = 0; r < 128; ++r) {
    const double rpm = 3000 + 1000 * (r % 4), advance = 0.1 + 0.6 * even(random);
    csv += fmt::format("{},{},{}\n", rpm, advance,
                       (0.11 - 0.09 * advance) * std::pow(rpm / 4500, 0.15) + 0.0005 * scatter(random));
  }
  const Explanation e =
      explained(observed(csv,
                         "[response]\ncolumn = \"CT\"\nunit = \"1\"\nmeaning = \"c_t_propeller\"\n[speed]\n"
                         "column = \"rpm\"\nunit = \"rpm\"\n[propeller]\ndiameter_m = 0.254\n"
                         "[[covariates]]\ncolumn = \"J\"\nunit = \"1\"\n",
                         "linear:J"));
  ASSERT_FALSE(e.adopted.empty());
  std::vector<std::string> set = e.adopted[0].confounded_with;
  set.push_back(e.adopted[0].term.effect->name);
  EXPECT_THAT(set, Contains("reynolds_number"));
  EXPECT_GT(e.adopted[0].parameters[0].value, 0.05);
}

/// Six rows of seventy that are ten times too large: none is far off by a variance that has all six in it.
TEST_F(TablesTest, GrossRowsDoNotHideEachOther) {
  std::string csv = "b,V,y\n";
  std::vector<std::string> wrong;
  for (int r = 0; r < 72; ++r) {
    const double volts = 10 + 2 * even(random);
    const bool slipped = r % 12 == 5;
    if (slipped) wrong.push_back(fmt::format("t.csv:{}", r + 2));
    csv += fmt::format("{},{},{}\n", r / 6, volts,
                       (slipped ? 70 : 7) * std::pow(volts / 11, 1.7) * (1 + 0.003 * scatter(random)));
  }
  const Explanation e =
      explained(observed(csv,
                         "blocks = \"b\"\n[response]\ncolumn = \"y\"\nunit = \"N\"\nmeaning = \"thrust_N\"\n"
                         "[[covariates]]\ncolumn = \"V\"\nunit = \"V\"\nmeaning = \"supply_voltage_V\"\n"));
  EXPECT_EQ(names(e), "supply_voltage ");
  std::vector<std::string> aside;
  for (const SuspectRow& row : e.suspect_rows)
    if (row.set_aside) aside.push_back(row.row);
  EXPECT_THAT(aside, testing::UnorderedElementsAreArray(wrong));
}

/// A heavy tail has no gap in it.
TEST_F(TablesTest, HeavyTailsAreNotSetAside) {
  std::student_t_distribution<double> heavy(3);
  int aside = 0;
  for (int table = 0; table < 5; ++table) {
    std::string csv = "y\n";
    for (int r = 0; r < 120; ++r) csv += fmt::format("{}\n", 100 + heavy(random));
    for (const SuspectRow& row :
         explained(observed(csv, "[response]\ncolumn = \"y\"\nunit = \"N\"\n")).suspect_rows)
      aside += row.set_aside ? 1 : 0;
  }
  EXPECT_LE(aside, 2);
}

/// Voltage acts by the speed, which a coefficient has; and a cell that is loaded has no motor.
TEST_F(TablesTest, WhatDrivesAMotorIsSoughtWhereItCanBeSeen) {
  std::string csv = "set,V,t,load,y\n";
  for (int r = 0; r < 80; ++r)
    csv += fmt::format("{},{},{},{},{}\n", r / 8, 11 + even(random), 300 * even(random),
                       10 * even(random) + 1, 3 * (1 + 0.01 * scatter(random)));
  const auto tested = [&](const char* effect, const std::string& response, const std::string& baseline) {
    return testability(test::effect_named(effect),
                       observed(csv,
                                "blocks = \"set\"\n[response]\ncolumn = \"y\"\n" + response +
                                    "[[covariates]]\ncolumn = \"V\"\nunit = \"V\"\n"
                                    "meaning = \"supply_voltage_V\"\n"
                                    "[[covariates]]\ncolumn = \"t\"\nunit = \"s\"\n"
                                    "meaning = \"time_since_motor_start_s\"\n"
                                    "[[covariates]]\ncolumn = \"load\"\nunit = \"N\"\n",
                                baseline))
        .ok();
  };
  const std::string thrust = "unit = \"N\"\nmeaning = \"thrust_N\"\n",
                    coefficient = "unit = \"1\"\nmeaning = \"c_t\"\n", counts = "unit = \"counts\"\n";
  EXPECT_TRUE(tested("supply_voltage", thrust, ""));
  EXPECT_FALSE(tested("supply_voltage", coefficient, ""));
  EXPECT_TRUE(tested("motor_warm_up", thrust, ""));
  EXPECT_FALSE(tested("motor_warm_up", counts, "linear:load"));
  EXPECT_TRUE(tested("creep", counts, "linear:load"));
}

TEST_F(TablesTest, PowerInWeatherIsTheAirsDensity) {
  std::string csv = "day,T,y\n";
  for (int r = 0; r < 96; ++r) {
    const double T_C = 5 + 25 * even(random);
    csv += fmt::format("{},{},{}\n", r / 6, T_C, 120 * 288 / (T_C + 273.15) * (1 + 0.002 * scatter(random)));
  }
  const Explanation e = explained(
      observed(csv,
               "blocks = \"day\"\n[response]\ncolumn = \"y\"\nunit = \"W\"\n"
               "[[covariates]]\ncolumn = \"T\"\nunit = \"degC\"\nmeaning = \"air_temperature_C\"\n"));
  EXPECT_EQ(names(e), "air_temperature ");
}

/// Thrust that scatters by as much at any speed is still C_T ρ n² D⁴.
TEST_F(TablesTest, ThrustOfAbsoluteScatterKeepsItsCoefficient) {
  std::string csv = "rpm,V,y\n";
  for (int r = 0; r < 96; ++r) {
    const double rpm = 3000 + 6000 * even(random);
    csv += fmt::format("{},{},{}\n", rpm, 10 + 2 * even(random), 1.1e-7 * rpm * rpm + 0.05 * scatter(random));
  }
  const Explanation e = explained(
      observed(csv,
               "[response]\ncolumn = \"y\"\nunit = \"N\"\nmeaning = \"thrust_N\"\nscatter = \"absolute\"\n"
               "[speed]\ncolumn = \"rpm\"\nunit = \"rpm\"\n[propeller]\ndiameter_m = 0.254\n"
               "[[covariates]]\ncolumn = \"V\"\nunit = \"V\"\nmeaning = \"supply_voltage_V\"\n"));
  EXPECT_EQ(e.verdict, "no_structure") << names(e);
  EXPECT_NEAR(e.noise_floor, 0.05, 0.012);
}

/// Days of one weather, their rows taken as independent.
TEST_F(TablesTest, RowsThatShareTheConditionFoundAreWarnedOf) {
  std::string csv = "V,y\n";
  for (int day = 0; day < 12; ++day) {
    const double volts = 10 + 2 * even(random);
    for (int r = 0; r < 8; ++r)
      csv += fmt::format("{},{}\n", volts, 7 * std::pow(volts / 11, 1.7) * (1 + 0.002 * scatter(random)));
  }
  const Explanation e =
      explained(observed(csv,
                         "[response]\ncolumn = \"y\"\nunit = \"N\"\nmeaning = \"thrust_N\"\n"
                         "[[covariates]]\ncolumn = \"V\"\nunit = \"V\"\nmeaning = \"supply_voltage_V\"\n"));
  EXPECT_FALSE(e.adopted.empty() && e.unknown.empty());
  EXPECT_THAT(e.warnings, Contains(HasSubstr("neighbouring rows share their supply_voltage_V")));
}

}  // namespace
}  // namespace tunnelrig
