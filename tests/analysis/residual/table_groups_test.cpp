// Groups of a table: amplitudes and lines of their own, and what is the same in all rows of one.
#include "analysis/report/explanation_page.h"
#include "analysis/residual/explanation/explanation_output.h"
#include "analysis/residual/tables.h"

#include <array>
#include <cmath>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

namespace tunnelrig {
namespace {

using test::explained;
using test::kMiddle_V;
using test::TablesTest;
using testing::HasSubstr;

/// Two speeds of a propeller tell no exponent, whatever they make of one: of 603 there is nothing to say.
TEST(GroupsInWords, ThoseThatTellNothingAreCounted) {
  AdoptedEffect adopted;
  adopted.term = {.effect = &test::effect_named("reynolds_number"), .per_group = true};
  adopted.term.parameters = {0.1};
  ParameterEstimate exponent;
  exponent.name = "exponent";
  exponent.groups = {{"a", 0.1, 0.05, 0.15}, {"b", 603, -495, 1702}, {"c", 0.2, 0.1, 0.3}};
  adopted.parameters = {exponent};
  Explanation e;
  e.adopted = {adopted};
  EXPECT_THAT(explanation_text(e),
              HasSubstr("the median of 3 groups from 0.1 (a) to 0.2 (c); of 1 nothing is known"));
}

/// Six cells in the same weather, of which one drifts up and another down: nothing that all have in common.
TEST_F(TablesTest, DriftsOfEitherSignAreFoundInEachGroup) {
  constexpr std::array<double, 6> kDrift_V_K = {2e-6, -1.5e-6, 0.6e-6, -1.8e-6, 1.4e-6, -0.7e-6};
  for (const double share : {0.0, 1.0}) {
    std::string csv = "cell,day,T,u\n";
    for (int day = 0; day < 20; ++day) {
      const double temperature = 20 + 6 * scatter(random);
      for (std::size_t cell = 0; cell < kDrift_V_K.size(); ++cell) {
        const double own = temperature + scatter(random);
        csv += fmt::format("{},{},{},{}\n", cell, day, own,
                           2e-3 + share * kDrift_V_K[cell] * (own - 20) + 3e-6 * scatter(random));
      }
    }
    const Explanation e = explained(
        observed(csv,
                 "groups = [\"cell\"]\nblocks = \"day\"\n[response]\ncolumn = \"u\"\nunit = \"V\"\n"
                 "[[covariates]]\ncolumn = \"T\"\nunit = \"degC\"\nmeaning = \"cell_temperature_C\"\n"));
    if (share == 0) {
      EXPECT_EQ(names(e), "");
      continue;
    }
    // At one load a drift of the span is the same.
    ASSERT_EQ(e.adopted.size(), 1u) << names(e);
    EXPECT_TRUE(e.adopted[0].term.per_group);
    const std::string& name = e.adopted[0].term.effect->name;
    const std::string both = name + " " + testing::PrintToString(e.adopted[0].confounded_with);
    EXPECT_THAT(both, HasSubstr("zero_drift_temperature"));
    EXPECT_THAT(both, HasSubstr("span_drift_temperature"));
    const double scale = name == "zero_drift_temperature" ? 1 : 2e-3;
    const auto& groups = e.adopted[0].parameters[0].groups;
    ASSERT_EQ(groups.size(), kDrift_V_K.size());
    for (std::size_t cell = 0; cell < groups.size(); ++cell)
      EXPECT_NEAR(groups[cell].value * scale, kDrift_V_K[cell], 0.4e-6);
    EXPECT_LT(e.after.held_out_rmse, 0.6 * e.before.held_out_rmse);
  }
}

/// A time constant that groups share beside amplitudes of their own has an interval, and it holds the truth.
TEST_F(TablesTest, ATimeConstantBesideAmplitudesOfGroupsIsEstimated) {
  constexpr std::array<double, 4> kCreep = {0.01, 0.04, 0.1, 0.16};
  constexpr double kTau_s = 20;
  std::string csv = "cell,day,t,u\n";
  for (int day = 0; day < 24; ++day)
    for (std::size_t cell = 0; cell < kCreep.size(); ++cell)
      for (int k = 0; k < 3; ++k) {
        const double t = 120 * even(random);
        csv +=
            fmt::format("{},{},{},{}\n", cell, day, t,
                        (5 + static_cast<double>(cell)) * (1 + kCreep[cell] * (1 - std::exp(-t / kTau_s))) *
                            (1 + 0.002 * scatter(random)));
      }
  ParameterEstimate tau;
  find_time_constant(csv, kTau_s, 1.5, tau);
  EXPECT_GT(tau.high - tau.low, 0.5);
  EXPECT_LT(tau.high - tau.low, 5);
}

TEST_F(TablesTest, GroupsWithExponentsOfTheirOwnAreTold) {
  std::string csv = "p,V,y\n";
  for (int r = 0; r < 80; ++r) {
    const double volts = 10.5 + 2 * even(random), exponent = r % 2 == 0 ? 1.4 : 2.0;
    csv += fmt::format("p{},{},{}\n", r % 2, volts,
                       (5 + r % 2) * std::pow(volts / kMiddle_V, exponent) * (1 + 0.002 * scatter(random)));
  }
  const Observations o =
      observed(csv,
               "groups = [\"p\"]\n[response]\ncolumn = \"y\"\nunit = \"N\"\n"
               "[[covariates]]\ncolumn = \"V\"\nunit = \"V\"\nmeaning = \"supply_voltage_V\"\n");
  const Explanation e = explained(o);
  ASSERT_EQ(names(e), "supply_voltage ");
  const ParameterEstimate& exponent = e.adopted[0].parameters[0];
  ASSERT_EQ(exponent.groups.size(), 2u);
  EXPECT_EQ(exponent.groups[0].group, "p0");
  EXPECT_NEAR(exponent.groups[0].value, 1.4, 0.05);
  EXPECT_NEAR(exponent.groups[1].value, 2.0, 0.05);
  EXPECT_NEAR(exponent.value, 1.7, 0.05);
  EXPECT_LT(exponent.low, exponent.groups[0].value);
  EXPECT_GT(exponent.high, exponent.groups[1].value);
  EXPECT_EQ(
      nlohmann::json::parse(explanation_json(e))["adopted"][0]["parameters"]["exponent"]["groups"].size(),
      2u);
  // The page draws what each group has: the line through the points, not the median's and not none.
  const std::string html = explanation_html(e, o, {}, {}),
                    start = R"(<script type="application/json" id="data">)";
  const std::size_t from = html.find(start) + start.size();
  const auto panel =
      nlohmann::json::parse(html.substr(from, html.find("</script>", from) - from))["panels"][0];
  double fitted2 = 0, after2 = 0;
  for (std::size_t i = 0; i < panel["x"].size(); ++i) {
    fitted2 += std::pow(panel["fitted"][i].get<double>(), 2);
    after2 += std::pow(panel["after"][i].get<double>(), 2);
  }
  EXPECT_GT(fitted2, 100 * after2);
}

/// A third of the force is no small effect: its logarithm is not its amplitude.
TEST_F(TablesTest, LargeAmplitudesOfGroupsAreThoseOfTheFormula) {
  constexpr std::array<double, 3> kAsymmetry = {-0.3, -0.1, 0.2};
  std::string csv = "g,i,n,F\n";
  for (std::size_t g = 0; g < kAsymmetry.size(); ++g)
    for (int i = 0; i < 80; ++i) {
      const double speed_rpm = 600 + 40 * (i / 2);
      const bool reverse = i % 2 == 1;
      const double force_N = 2.75e-6 * speed_rpm * speed_rpm * (reverse ? -1 - kAsymmetry[g] : 1);
      csv += fmt::format("{},{},{},{}\n", g, i, speed_rpm, force_N + 0.02 * scatter(random));
    }
  const Explanation e =
      explained(observed(csv,
                         "groups = [\"g\"]\nblocks = \"bins(i, 20)\"\n"
                         "[response]\ncolumn = \"F\"\nunit = \"N\"\nmeaning = \"thrust_N\"\n"
                         "[speed]\ncolumn = \"n\"\nunit = \"rpm\"\n"));
  ASSERT_EQ(names(e), "bidirectional ");
  const auto& groups = e.adopted[0].parameters[0].groups;
  ASSERT_EQ(groups.size(), kAsymmetry.size());
  for (std::size_t g = 0; g < groups.size(); ++g) {
    EXPECT_NEAR(groups[g].value, kAsymmetry[g], 0.006);
    EXPECT_NEAR(groups[g].low, kAsymmetry[g], 0.015) << "the interval is no wider than the data";
    EXPECT_NEAR(groups[g].high, kAsymmetry[g], 0.015);
  }
}

/// What the groups' constants absorb is no part of a curve: two packs, and between them no voltage.
TEST_F(TablesTest, ACurveIsDrawnWhereGroupsShowItAndNotBetween) {
  constexpr double kHeight_N = 0.1;  // of an arch in either pack
  std::string csv = "pack,V,y\n";
  for (int r = 0; r < 160; ++r) {
    const double u = 2 * even(random) - 1, volts = r % 2 == 0 ? 7.4 + 0.4 * u : 9.6 + 0.4 * u;
    csv += fmt::format("{},{},{}\n", r % 2, volts,
                       (r % 2 == 0 ? 4 : 9) + kHeight_N * (1 - u * u) + 0.004 * scatter(random));
  }
  const Explanation e = explained(observed(csv,
                                           "groups = [\"pack\"]\n[response]\ncolumn = \"y\"\n"
                                           "unit = \"N\"\nscatter = \"absolute\"\n"
                                           "[[covariates]]\ncolumn = \"V\"\nunit = \"1\"\n"));
  ASSERT_EQ(e.unknown.size(), 1u);
  EXPECT_NEAR(e.unknown[0].amplitude, kHeight_N / 2, 0.5 * kHeight_N / 2);
  for (const ShapePoint& point : e.unknown[0].shape) {
    EXPECT_TRUE(point.x < 7.81 || point.x > 9.19) << point.x;
    EXPECT_LT(std::abs(point.y), kHeight_N);
  }
}

/// A moment that is always the force times one arm is in the line of that group, whatever it leaks.
TEST_F(TablesTest, AGroupWhoseLineAbsorbsTheEffectHasNoAmplitude) {
  constexpr std::array<double, 3> kLeak = {0.2, 0.25, 0.22};
  std::string csv = "mount,fx,my,y\n";
  for (std::size_t mount = 0; mount < kLeak.size(); ++mount)
    for (int r = 0; r < 24; ++r) {
      const double fx = 20 * even(random), my = mount == 2 ? 0.15 * fx : 3 * even(random);
      csv += fmt::format("m{},{},{},{}\n", mount, fx, my, fx + kLeak[mount] * my + 0.01 * scatter(random));
    }
  const Observations o = observed(csv,
                                  "groups = [\"mount\"]\n[response]\ncolumn = \"y\"\nunit = \"N\"\n"
                                  "[[covariates]]\ncolumn = \"fx\"\nunit = \"N\"\n"
                                  "[[covariates]]\ncolumn = \"my\"\nunit = \"N m\"\n",
                                  "linear:fx");
  const TableEffects effects(o, test::every_effect());
  const Explanation e = explain(o, effects.all, test::quick());
  ASSERT_EQ(names(e), "crosstalk ") << explanation_text(e);
  const auto& groups = e.adopted[0].parameters[0].groups;
  ASSERT_EQ(groups.size(), 2u);
  for (std::size_t mount = 0; mount < 2; ++mount) {
    EXPECT_EQ(groups[mount].group, fmt::format("m{}", mount));
    EXPECT_LE(groups[mount].low, kLeak[mount] + 0.01);
    EXPECT_GE(groups[mount].high, kLeak[mount] - 0.01);
  }
}

/// Lines of 24 groups, which are the blocks too: of a held-out group the slope is as unknown as the constant.
TEST_F(TablesTest, HeldOutGroupsHaveSlopesOfTheirOwn) {
  std::string csv = "g,x,y\n";
  for (int group = 0; group < 24; ++group) {
    const double slope = 1 + even(random);
    for (int r = 0; r < 10; ++r) {
      const double x = r + even(random);
      csv += fmt::format("{},{},{}\n", group, x, group + slope * x + 0.05 * scatter(random));
    }
  }
  const Explanation e = explained(observed(
      csv, "groups = [\"g\"]\nblocks = \"g\"\n[response]\ncolumn = \"y\"\nunit = \"N\"\n", "linear:x"));
  EXPECT_EQ(names(e), "");
  EXPECT_LT(e.before.held_out_rmse, 2 * e.noise_floor);
  EXPECT_LT(e.noise_floor, 0.1);
}

/// Far from the ground nobody writes a distance.
TEST_F(TablesTest, AnEmptyDistanceIsNoEffect) {
  std::string csv = "b,z,y\n";
  for (int r = 0; r < 90; ++r) {
    const double z = 1 + r % 3;
    const bool far = r % 3 == 2;
    const double force = far ? 5 : 5 / (1 - std::pow(4 * z, -2));
    csv += fmt::format("{},{},{}\n", r / 6, far ? "" : fmt::format("{}", z),
                       force * (1 + 0.002 * scatter(random)));
  }
  const Explanation e =
      explained(observed(csv,
                         "blocks = \"b\"\n[response]\ncolumn = \"y\"\nunit = \"N\"\nmeaning = \"thrust_N\"\n"
                         "[[covariates]]\ncolumn = \"z\"\nunit = \"1\"\nmeaning = \"ground_distance_R\"\n"));
  EXPECT_EQ(names(e), "ground_effect ");
}

/// Creep under one load changes the force by itself, of which no second effect is to be read off.
TEST_F(TablesTest, WhatOneForceCannotShowIsNotTriedBesideAnother) {
  std::string csv = "cycle,t,u\n";
  for (int cycle = 0; cycle < 8; ++cycle)
    for (int r = 0; r < 40; ++r) {
      const double t = 10 * r + 1;
      csv += fmt::format("{},{},{}\n", cycle, t,
                         (6e6 + 1e4 * cycle) * (1 + 0.005 * (1 - std::exp(-t / 75))) + 900 * scatter(random));
    }
  const Explanation e = explained(
      observed(csv,
               "groups = [\"cycle\"]\n[response]\ncolumn = \"u\"\nunit = \"counts\"\n"
               "[[covariates]]\ncolumn = \"t\"\nunit = \"s\"\nmeaning = \"time_since_motor_start_s\"\n"));
  EXPECT_THAT(names(e), testing::Not(HasSubstr("nonlinearity")));
  EXPECT_THAT(names(e), HasSubstr("creep"));
}

/// Where groups have Reynolds exponents of their own, these can take the square of the speed into themselves.
TEST_F(TablesTest, TheSquareOfTheSpeedIsNoGroupsOwn) {
  constexpr std::array<double, 2> kExponent = {0.1, 0.3};
  for (int table = 0; table < 6; ++table) {
    std::string csv = "motor,file,n,y\n";
    for (std::size_t motor = 0; motor < kExponent.size(); ++motor)
      for (int r = 0; r < 120; ++r) {
        const double n = 1500 + 5500 * even(random);
        csv +=
            fmt::format("{},{}-{},{},{}\n", motor, motor, r / 12, n,
                        1.5e-7 * n * n * std::pow(n / 4000, kExponent[motor]) * (1 + 0.02 * scatter(random)));
      }
    const Explanation e = explained(
        observed(csv,
                 "groups = [\"motor\"]\nblocks = \"file\"\n[response]\ncolumn = \"y\"\nunit = \"N\"\n"
                 "meaning = \"thrust_N\"\n[speed]\ncolumn = \"n\"\nunit = \"rpm\"\n"));
    ASSERT_EQ(names(e), "rotor_speed reynolds_number ") << "table " << table;
    const auto& groups = e.adopted[1].parameters[0].groups;
    ASSERT_EQ(groups.size(), kExponent.size());
    for (std::size_t motor = 0; motor < kExponent.size(); ++motor)
      EXPECT_NEAR(groups[motor].value, kExponent[motor], 0.03);
  }
}

/// A bend of each group's power law over the speed is as likely the law's as its blades'.
TEST_F(TablesTest, BendsOfTheGroupsLawsHaveNoName) {
  std::string csv = "rotor,n,y\n";
  for (int rotor = 0; rotor < 2; ++rotor)
    for (int r = 0; r < 60; ++r) {
      const double n = 2000 + 4000 * even(random), x = std::log(n / 4000), bend = rotor == 0 ? 0.2 : -0.2;
      csv +=
          fmt::format("{},{},{}\n", rotor, n, 5 * std::exp(2.1 * x + bend * x * x + 0.003 * scatter(random)));
    }
  const std::string schema =
      "groups = [\"rotor\"]\nblocks = \"rows\"\n[response]\ncolumn = \"y\"\nunit = \"N\"\n"
      "meaning = \"thrust_N\"\n[speed]\ncolumn = \"n\"\nunit = \"rpm\"\n";
  const Observations over_speed = observed(csv, schema, "power:n");
  EXPECT_EQ(names(explained(over_speed)), "");
  const Effect& flex = test::effect_named("blade_flex");
  EXPECT_TRUE(goes_by_the_law_alone(flex, over_speed));
  EXPECT_FALSE(goes_by_the_law_alone(flex, observed(csv, schema)));
}

}  // namespace
}  // namespace tunnelrig
