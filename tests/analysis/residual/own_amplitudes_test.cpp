// Effects whose amplitudes differ from group to group: that they are found, and how their shapes are.
#include "analysis/residual/tables.h"
#include "support/message_of.h"

#include <array>
#include <cmath>

#include <fmt/format.h>
#include <gmock/gmock.h>

namespace tunnelrig {
namespace {

using test::explained;
using test::TablesTest;
using testing::HasSubstr;

/// By restricted likelihoods alone it would be the time constant whose columns do least: columns that do
/// nothing cost nothing.
TEST_F(TablesTest, ATimeConstantIsNotTheOneWithTheSmallestColumns) {
  constexpr double kTau_s = 60;
  std::string csv = "cell,day,t,u\n";
  for (int day = 0; day < 12; ++day)
    for (int cell = 0; cell < 10; ++cell)
      for (int k = 0; k < 3; ++k) {
        const double t = 5 + 295 * even(random), amplitude = 0.002 + 0.0018 * cell;
        csv += fmt::format(
            "{},{},{},{}\n", cell, day, t,
            (5 + cell) * (1 + amplitude * (1 - std::exp(-t / kTau_s))) * (1 + 0.003 * scatter(random)));
      }
  ParameterEstimate tau;
  find_time_constant(csv, kTau_s, 25, tau);
}

/// What all groups have in common is barely beyond chance and predicts no unseen day; the groups' own do.
TEST_F(TablesTest, AmplitudesOfEitherSignAreFoundThoughTheirMeanIsNone) {
  constexpr std::array<double, 6> kDrift_K = {-0.004, -0.0025, -0.001, 0.001, 0.0025, 0.0045};
  int found = 0;
  constexpr int kTables = 6;
  for (int table = 0; table < kTables; ++table) {
    std::string csv = "cell,day,T,y\n";
    for (int day = 0; day < 18; ++day) {
      const double phase = 6.28 * even(random);
      for (std::size_t cell = static_cast<std::size_t>(day) % 3 * 2, k = 0; k < 24; ++k) {
        const std::size_t own = cell + k / 12;
        const double temperature_C = 20 + 8 * std::sin(phase + 0.35 * static_cast<double>(k));
        csv += fmt::format("{},{},{},{}\n", own, day, temperature_C,
                           (10 + static_cast<double>(own)) * (1 + kDrift_K[own] * (temperature_C - 20)) *
                               (1 + 0.002 * scatter(random)));
      }
    }
    const Explanation e = explained(
        observed(csv,
                 "groups = [\"cell\"]\nblocks = \"day\"\n[response]\ncolumn = \"y\"\nunit = \"N\"\n"
                 "[[covariates]]\ncolumn = \"T\"\nunit = \"degC\"\nmeaning = \"cell_temperature_C\"\n"));
    found += !e.adopted.empty() && e.adopted[0].term.per_group ? 1 : 0;
  }
  EXPECT_GE(found, kTables - 1);
}

/// A zero of 100 kN worth of counts is no scatter of what the run before was predicted to be.
TEST_F(TablesTest, AnOffsetOfTheConverterHidesNoHysteresis) {
  for (const double offset : {0.0, 1e5}) {
    std::string csv = "set,order,F,u\n";
    double before_N = 0;
    for (int r = 0; r < 160; ++r) {
      const double force_N = 5 * static_cast<double>(1 + random() % 8);
      const double turn = before_N > force_N ? 1 : before_N < force_N ? -1 : 0;
      csv +=
          fmt::format("{},{},{},{}\n", r / 8, r, force_N,
                      offset + 1000 * force_N * (1 + (r % 8 > 0 ? 0.02 * turn : 0)) + 30 * scatter(random));
      before_N = force_N;
    }
    const Explanation e =
        explained(observed(csv,
                           "blocks = \"set\"\n[response]\ncolumn = \"u\"\nunit = \"counts\"\n"
                           "[[covariates]]\ncolumn = \"F\"\nunit = \"N\"\n"
                           "[[covariates]]\ncolumn = \"order\"\nunit = \"1\"\nmeaning = \"run_order\"\n",
                           "linear:F"));
    ASSERT_EQ(names(e), "hysteresis ") << offset;
    EXPECT_NEAR(e.adopted[0].parameters[0].value, 0.02, 0.002);
  }
}

constexpr const char* kTorques =
    "blocks = \"set\"\n[response]\ncolumn = \"y\"\nunit = \"N m\"\n"
    "[[covariates]]\ncolumn = \"T\"\nunit = \"degC\"\nmeaning = \"air_temperature_C\"\n";

TEST_F(TablesTest, ABlockInAnotherUnitIsSaid) {
  std::string csv = "set,T,y\n";
  for (int r = 0; r < 80; ++r)
    csv += fmt::format("{},{},{}\n", r / 8, 20 + scatter(random),
                       (r / 8 == 4 ? 10.2 : 1) * 3 * (1 + 0.01 * scatter(random)));
  const Explanation e = explained(observed(csv, kTorques));
  EXPECT_THAT(e.warnings,
              testing::Contains(HasSubstr("y of block 4 is 10.2 times what the others let expect")));
}

TEST_F(TablesTest, AnEmptyCellIsNeitherHeldOutNorNot) {
  std::string csv = "set,T,q,y\n";
  for (int r = 0; r < 80; ++r)
    csv += fmt::format("{},{},{},{}\n", r / 8, 20 + scatter(random),
                       r == 30 ? "" : std::to_string(even(random)), 3 * (1 + 0.01 * scatter(random)));
  for (const char* rule : {"q > 0.7", "rank(q) > 0.7"})
    EXPECT_THAT(test::message_of([&] { observed(csv, fmt::format("hold_out = \"{}\"\n", rule) + kTorques); }),
                HasSubstr("t.csv:32: "))
        << rule;
}

TEST_F(TablesTest, WindIsSoughtInWhatIsARotors) {
  std::string csv = "set,v,y\n";
  for (int r = 0; r < 80; ++r) {
    const double wind_m_s = 12 + scatter(random);
    csv +=
        fmt::format("{},{},{}\n", r / 8, wind_m_s, 3 - 0.01 * wind_m_s * wind_m_s + 0.02 * scatter(random));
  }
  for (const std::string meaning : {"", "meaning = \"thrust_N\"\n"}) {
    const Explanation e = explained(observed(
        csv, "blocks = \"set\"\n[response]\ncolumn = \"y\"\nunit = \"N\"\n" + meaning +
                 "[[covariates]]\ncolumn = \"v\"\nunit = \"m/s\"\nmeaning = \"tunnel_airspeed_m_s\"\n"));
    EXPECT_EQ(names(e), meaning.empty() ? "" : "axial_wind ");
  }
}

}  // namespace
}  // namespace tunnelrig
