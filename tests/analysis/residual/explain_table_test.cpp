// `tunnelrig explain` on simulated tables.
#include "analysis/residual/explain_program.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>

#include <gmock/gmock.h>

namespace tunnelrig {
namespace {

using nlohmann::json;
using test::ExplainProgram;
using test::ProgramResult;
using testing::HasSubstr;

struct ExplainTable : ExplainProgram {
  std::string schema = "format = \"tunnelrig-table/1\"\nname = \"t\"\ngroups = [\"g\"]\nblocks = \"day\"\n";
  std::string response = "[response]\ncolumn = \"F\"\nunit = \"N\"\n";
  std::string covariates =
      "[[covariates]]\ncolumn = \"V\"\nunit = \"V\"\nmeaning = \"supply_voltage_V\"\n"
      "[[covariates]]\ncolumn = \"T\"\nunit = \"degC\"\nmeaning = \"air_temperature_C\"\n";

  void write_table(const std::function<std::string(double force)>& cell, double temperature_C = 20) {
    std::string csv = "g,day,F,V,T\n";
    for (int row = 0; row < 80; ++row) {
      const double volts = std::uniform_real_distribution<double>(15, 17)(random);
      const double force = 5 * std::pow(volts / 16, 0.8) * (1 + normal(0.003));
      csv += fmt::format("g{},d{},{},{:.4f},{:.2f}\n", row % 2, row / 8, cell(force), volts,
                         temperature_C + normal(1));
    }
    write_text(folder / "t.csv", csv);
    write_text(folder / "t.toml", schema + response + covariates);
  }
  ProgramResult import_table(const std::string& csv, const std::string& toml) const {
    write_text(folder / "t.csv", csv);
    write_text(folder / "t.toml", toml);
    return import_table();
  }
  ProgramResult import_table() const {
    return run("import t.csv --format table --schema t.toml --db c.db --replace");
  }
};

std::string plain(double force) { return fmt::format("{:.5f}", force); }

TEST_F(ExplainTable, NamesAStrongEffect) {
  write_table(plain);
  ASSERT_EQ(import_table().code, 0);
  const json e = explained();
  EXPECT_EQ(e["verdict"], "explained");
  ASSERT_EQ(e["adopted"].size(), 1u);
  EXPECT_EQ(e["adopted"][0]["effect"], "supply_voltage");
  EXPECT_EQ(e["response"], "F");
}

/// What goes with the force itself is drawn over that, run order or not.
TEST_F(ExplainTable, AZeroThatWasNotTakenOffIsDrawnOverTheForce) {
  std::string csv = "day,N,F\n";
  for (int row = 0; row < 80; ++row) {
    const double rpm = std::uniform_real_distribution<double>(3000, 7000)(random);
    csv += fmt::format("d{},{:.1f},{:.5f}\n", row / 8, rpm,
                       (6 * std::pow(rpm / 5000, 2) + 0.08) * (1 + normal(0.002)));
  }
  const std::string toml =
      "format = \"tunnelrig-table/1\"\nname = \"t\"\nblocks = \"day\"\n[response]\ncolumn = \"F\"\n"
      "unit = \"N\"\nmeaning = \"thrust_N\"\n[speed]\ncolumn = \"N\"\nunit = \"rpm\"\n"
      "[propeller]\ndiameter_m = 0.25\n";
  ASSERT_EQ(import_table(csv, toml).code, 0);
  const json e = explained("--html e.html");
  ASSERT_EQ(e["adopted"].size(), 1u);
  EXPECT_EQ(e["adopted"][0]["effect"], "zero_offset");
  EXPECT_THAT(read_text(folder / "e.html"), HasSubstr(R"("covariate":"predicted F","covariate_unit":"N")"));
}

/// What the runs scatter by is found beside all that was found. Where the baseline lacks a curve, weights
/// made of what it leaves would pull it away from the plain mean, and "before" would be worse than it is.
TEST_F(ExplainTable, TheErrorBeforeIsNoWorseThanThatOfTheMean) {
  std::string csv = "key,late,f,y\n";
  std::vector<double> early, late;
  for (int block = 0; block < 24; ++block)
    for (int i = 0; i < 8 + block * 5 % 7; ++i) {
      const double decades = 2.3 + 0.7 * (block * 7 % 24) / 24 + 0.1 * i;
      const double y = 100 - 30 * std::pow(decades - 2.9, 2) + normal(0.5);
      const bool is_late = block >= 18;
      (is_late ? late : early).push_back(y);
      csv += fmt::format("k{},{},{:.1f},{:.3f}\n", block, is_late ? 1 : 0, std::pow(10, decades), y);
    }
  const std::string toml =
      "format = \"tunnelrig-table/1\"\nname = \"t\"\nblocks = \"key\"\nhold_out = \"late > 0.5\"\n"
      "[response]\ncolumn = \"y\"\nunit = \"1\"\n[[covariates]]\ncolumn = \"f\"\nunit = \"Hz\"\n"
      "[[covariates]]\ncolumn = \"late\"\nunit = \"1\"\n";
  ASSERT_EQ(import_table(csv, toml).code, 0);
  const json e = explained();
  EXPECT_EQ(e["verdict"], "unknown");
  const double mean = std::accumulate(early.begin(), early.end(), 0.0) / static_cast<double>(early.size());
  double squares = 0;
  for (const double y : late) squares += std::pow(y - mean, 2) / static_cast<double>(late.size());
  EXPECT_LT(e["before"]["held_out_rmse"], 1.03 * std::sqrt(squares));
  EXPECT_EQ(e["after"], e["before"]);
}

/// A wave over a condition that has one value far out: without that run the curve is far off there, and data
/// sets in which it scatters as much would have waves of their own, all of them.
TEST_F(ExplainTable, OneValueFarOutHidesNoWave) {
  std::uint64_t state = 27;  // of these numbers, and not of all, it did
  const auto uniform = [&] {
    state = state * 6364136223846793005U + 1442695040888963407U;
    return static_cast<double>(state >> 11U) / 9007199254740992.;
  };
  const auto nearly_normal = [&] {
    double sum = -6;
    for (int i = 0; i < 12; ++i) sum += uniform();
    return sum;
  };
  for (int i = 0; i < 10; ++i) uniform();
  std::string csv = "day,F,x\n";
  for (int row = 0; row < 200; ++row) {
    double x = std::clamp(20 + 2.2 * nearly_normal(), 14., 24.5);
    if (row == 77) x = 26.8;
    csv += fmt::format("d{},{:.5f},{:.3f}\n", row / 10,
                       5 * (1 + 0.0044 * std::sin(1.9 * (x - 20))) * (1 + 0.004 * nearly_normal()), x);
  }
  const std::string toml =
      "format = \"tunnelrig-table/1\"\nblocks = \"day\"\n[response]\ncolumn = \"F\"\nunit = \"N\"\n"
      "[[covariates]]\ncolumn = \"x\"\nunit = \"mm\"\n";
  ASSERT_EQ(import_table(csv, toml).code, 0);
  const json e = explained();
  ASSERT_EQ(e["unknown"].size(), 1u);
  EXPECT_EQ(e["unknown"][0]["covariate"], "x");
}

TEST_F(ExplainTable, ConstantOrEmptyResponsesAreRefused) {
  write_table([](double) { return "5"; });
  ASSERT_EQ(import_table().code, 0);
  const ProgramResult constant = run("explain --db c.db");
  EXPECT_EQ(constant.code, 2);
  EXPECT_THAT(constant.error, HasSubstr("same in every row"));
  for (const char* nothing : {"", "nan"}) {
    write_table([&](double) { return nothing; });
    const ProgramResult refused = import_table();
    EXPECT_EQ(refused.code, 2) << nothing;
    EXPECT_THAT(refused.error, HasSubstr("t.csv:2"));
  }
}

TEST_F(ExplainTable, KelvinInACelsiusColumnIsRefused) {
  write_table(plain, 293);
  const ProgramResult refused = import_table();
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.error, HasSubstr("t.csv:2"));
  EXPECT_THAT(refused.error, HasSubstr("kelvin"));
}

TEST_F(ExplainTable, MistakesInHoldOutNameFileAndExpression) {
  for (const auto& [expression, reason] :
       std::vector<std::pair<std::string, std::string>>{{"V > ", "V > "},
                                                        {"nosuch > 3", "nosuch"},
                                                        {"V > 1000", "all rows or none"},
                                                        {"rank(V", "rank("}}) {
    schema =
        "format = \"tunnelrig-table/1\"\nname = \"t\"\ngroups = [\"g\"]\nblocks = \"day\"\nhold_out = \"" +
        expression + "\"\n";
    write_table(plain);
    const ProgramResult imported = import_table();
    const ProgramResult refused = imported.code == 0 ? run("explain --db c.db") : imported;
    EXPECT_EQ(refused.code, 2) << expression;
    EXPECT_THAT(refused.error, HasSubstr(reason));
  }
}

TEST_F(ExplainTable, HoldOutIsWhatIsScored) {
  schema += "hold_out = \"rank(V) > 0.7\"\n";
  write_table(plain);
  ASSERT_EQ(import_table().code, 0);
  const json e = explained();
  ASSERT_EQ(e["adopted"].size(), 1u);
  EXPECT_EQ(e["adopted"][0]["effect"], "supply_voltage");
  EXPECT_GT(e["before"]["held_out_rmse"], 2 * e["before"]["rmse"].get<double>()) << "beyond what was fitted";
  EXPECT_LT(e["after"]["held_out_rmse"], 0.03);
}

TEST_F(ExplainTable, BaselinesAreColumns) {
  write_table(plain);
  ASSERT_EQ(import_table().code, 0);
  EXPECT_EQ(explained("--baseline power:V")["verdict"], "no_structure") << "the baseline has it already";
  EXPECT_EQ(explained("--baseline linear:V")["unit"], "N");
  EXPECT_EQ(run("explain --db c.db --baseline power:nosuch").code, 2);
  EXPECT_EQ(run("explain --db c.db --baseline cubic:V").code, 2);
}

TEST_F(ExplainTable, ARowOfTheOtherSignHasNoPower) {
  int row = 0;
  write_table([&row](double force) { return fmt::format("{}", row++ == 4 ? -force : force); });
  ASSERT_EQ(import_table().code, 0);
  const ProgramResult refused = run("explain --db c.db --baseline power:V");
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.error, HasSubstr("t.csv:6: --baseline power:V: the response must have one sign"));
}

}  // namespace
}  // namespace tunnelrig
