// What acts in a part of the rows only, and groups that are held out whole.
#include "analysis/residual/explanation/explanation_output.h"
#include "analysis/residual/tables.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>

namespace tunnelrig {
namespace {

using test::explained;
using testing::HasSubstr;

struct PartsOfRows : test::TablesTest {
  /// Twenty cells, each with a line of its own over the load, of which F goes with the excitation; a cell is
  /// a block, and the last are held out.
  Observations cells(const std::string& baseline) {
    std::string csv = "cell,nr,E,load,y\n";
    for (int cell = 0; cell < 20; ++cell) {
      const double zero_N = 5 + 10 * even(random), gain = 0.9 + 0.2 * even(random);
      for (int row = 0; row < 12; ++row) {
        const double load_N = 5 + 45 * even(random), excitation_V = 10 + 0.2 * scatter(random);
        const double force_N = baseline.empty() ? zero_N : gain * load_N;
        csv += fmt::format(
            "c{},{},{},{},{}\n", cell, cell, excitation_V, load_N,
            (baseline.empty() ? 0 : zero_N) + force_N * excitation_V / 10 + 0.05 * scatter(random));
      }
    }
    return observed(
        csv,
        "groups = [\"cell\"]\nblocks = \"cell\"\nhold_out = \"nr > 14\"\n[response]\ncolumn = \"y\"\n"
        "unit = \"N\"\nscatter = \"absolute\"\n[[covariates]]\ncolumn = \"E\"\nunit = \"V\"\n"
        "meaning = \"excitation_voltage_V\"\n[[covariates]]\ncolumn = \"load\"\nunit = \"N\"\n",
        baseline);
  }

  /// 200 rows of 20 blocks and five groups, of which x does something where `acts` says.
  Observations where(const std::function<double(int group, double v, double u)>& acts) {
    std::string csv = "blk,grp,x,v,u,y\n";
    for (int row = 0; row < 200; ++row) {
      const double x = 5 * scatter(random), u = 100 * even(random);
      const int group = row % 5, v = even(random) < 0.5 ? 0 : 1;
      csv += fmt::format("{},g{},{},{},{},{}\n", row / 10, group, x, v, u,
                         1 + 0.1 * group + 0.006 * x * acts(group, v, u) + 0.005 * scatter(random));
    }
    return observed(
        csv,
        "groups = [\"grp\"]\nblocks = \"blk\"\n[response]\ncolumn = \"y\"\nunit = \"1\"\n"
        "[[covariates]]\ncolumn = \"x\"\nunit = \"1\"\n[[covariates]]\ncolumn = \"v\"\nunit = \"1\"\n"
        "[[covariates]]\ncolumn = \"u\"\nunit = \"1\"\n");
  }
};

/// The force of a cell that the fit has not seen is what its own rows say, as its line is.
TEST_F(PartsOfRows, GroupsHeldOutWholeHaveTheirOwnForce) {
  for (const std::string baseline : {"", "linear:load"}) {
    const Explanation e = explained(cells(baseline));
    EXPECT_EQ(names(e), "excitation_voltage ") << baseline;
    EXPECT_LT(e.after.held_out_rmse, 0.5 * e.before.held_out_rmse) << baseline;
    EXPECT_LT(e.after.held_out_rmse, 1.4 * e.noise_floor) << baseline;
  }
}

/// To any one curve such an effect is a scatter: the larger, the surer.
TEST_F(PartsOfRows, WhatActsInOneStateIsNoScatter) {
  const auto in_state = [](int, double v, double) { return v; };
  const auto beyond = [](int, double, double u) { return u > 70 ? 1.0 : 0.0; };
  const auto in_group = [](int group, double, double) { return group == 2 ? 1.0 : 0.0; };
  constexpr int kOfEach = 2;
  int found = 0;
  for (const auto& acts : {std::function<double(int, double, double)>(in_state), {beyond}, {in_group}})
    for (int table = 0; table < kOfEach; ++table) {
      const Explanation e = explained(where(acts));
      found += std::ranges::any_of(e.unknown, [](const UnknownStructure& u) { return u.covariate == "x"; })
                   ? 1
                   : 0;
    }
  EXPECT_GE(found, 2 * kOfEach) << "of " << 3 * kOfEach;
}

/// What scatters more in one state is a scatter all the same.
TEST_F(PartsOfRows, WhatScattersInOneStateIsNoStructure) {
  int found = 0;
  for (int table = 0; table < 4; ++table) {
    const auto wild = [&](int, double v, double) { return v * scatter(random); };
    const Explanation e = explained(where(wild));
    found += e.adopted.empty() && e.unknown.empty() ? 0 : 1;
  }
  EXPECT_LE(found, 1);
}

/// Groups whose responses differ in sign have no logarithm in common: what acts on all is as large in each.
TEST_F(PartsOfRows, GroupsOfEitherSignScatterAlike) {
  std::string csv = "blk,grp,x,y\n";
  for (int row = 0; row < 160; ++row) {
    const double x = scatter(random), mean_Nm[] = {-2, -0.3, 0.4, 3};
    csv += fmt::format("{},g{},{},{}\n", row / 10, row % 4, x,
                       mean_Nm[row % 4] + 0.02 * x + 0.01 * scatter(random));
  }
  const Explanation e =
      explained(observed(csv,
                         "groups = [\"grp\"]\nblocks = \"blk\"\n[response]\ncolumn = \"y\"\nunit = \"N m\"\n"
                         "[[covariates]]\ncolumn = \"x\"\nunit = \"1\"\n"));
  ASSERT_EQ(e.unknown.size(), 1u);
  EXPECT_EQ(e.unknown[0].covariate, "x");
}

}  // namespace
}  // namespace tunnelrig
