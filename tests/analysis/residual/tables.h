// Tables given as texts, for tests of what is found in them.
#pragma once

#include "analysis/residual/explanation/explanation_parts.h"
#include "analysis/residual/simulated.h"
#include "support/seeds.h"

#include <cmath>
#include <random>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace tunnelrig::test {

inline constexpr double kMiddle_V = 11.5;

struct TablesTest : testing::Test {
  std::mt19937_64 random{seed()};
  std::normal_distribution<double> scatter;
  std::uniform_real_distribution<double> even{0, 1};

  static Observations observed(const std::string& csv, const std::string& schema,
                               const std::string& baseline = "") {
    return observe_table(
        read_observations(parse_csv(csv, "t.csv"),
                          parse_table_schema("format = \"tunnelrig-table/1\"\n" + schema, "s.toml")),
        {.baseline = baseline});
  }
  static std::string names(const Explanation& e) {
    std::string all;
    for (const AdoptedEffect& adopted : e.adopted) all += adopted.term.effect->name + " ";
    return all;
  }

  /// The time constant of a creep that each cell has in its own measure: found, with an interval that holds
  /// the truth. Columns cell, day, t and u.
  static void find_time_constant(const std::string& csv, double truth_s, double within_s,
                                 ParameterEstimate& tau) {
    const Explanation e = explained(
        observed(csv,
                 "groups = [\"cell\"]\nblocks = \"day\"\n[response]\ncolumn = \"u\"\nunit = \"N\"\n"
                 "[[covariates]]\ncolumn = \"t\"\nunit = \"s\"\nmeaning = \"time_since_motor_start_s\"\n"));
    ASSERT_EQ(names(e), "creep ");
    ASSERT_TRUE(e.adopted[0].term.per_group);
    tau = e.adopted[0].parameters[1];
    EXPECT_NEAR(tau.value, truth_s, within_s);
    EXPECT_LT(tau.low, truth_s);
    EXPECT_GT(tau.high, truth_s);
  }

  /// Thrust by voltage, 96 rows in 12 blocks of 0.3 %; `wrong` multiplies the row on line 24.
  Observations thrusts(double wrong) {
    std::string csv = "b,V,y\n";
    for (int r = 0; r < 96; ++r) {
      const double volts = 10.5 + 2 * even(random);
      const double force_N = 8 * std::pow(volts / kMiddle_V, 1.7) * (1 + 0.003 * scatter(random));
      csv += fmt::format("{},{},{}\n", r / 8, volts, r == 22 ? wrong * force_N : force_N);
    }
    return observed(csv,
                    "blocks = \"b\"\n[response]\ncolumn = \"y\"\nunit = \"N\"\nmeaning = \"thrust_N\"\n"
                    "[[covariates]]\ncolumn = \"V\"\nunit = \"V\"\nmeaning = \"supply_voltage_V\"\n");
  }
};

}  // namespace tunnelrig::test
