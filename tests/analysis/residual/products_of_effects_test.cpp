// Effects that add forces, one of which acts on what another has made.
#include "analysis/residual/explanation/explanation_output.h"
#include "analysis/residual/tables.h"

#include <cmath>
#include <limits>
#include <optional>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>

namespace tunnelrig {
namespace {

using test::explained;

struct ProductsOfEffectsTest : test::TablesTest {
  static constexpr double kAsymmetry = -0.03, kBend_per_V = 0.02;

  /// Volts of a cell over its load, 20 cycles; `excited`: its supply varies by 2 %.
  std::string cell(bool excited) {
    std::string csv = "cycle,load,E,U\n";
    for (int cycle = 0; cycle < 20; ++cycle) {
      const double excitation_V = 5 + 0.1 * scatter(random);
      for (const double load_N : {-20., -10., -5., 0., 5., 10., 20., 30.}) {
        const double pulled_V = 0.02 * load_N * (load_N < 0 ? 1 + kAsymmetry : 1);
        const double bent_V = pulled_V * (1 + kBend_per_V * pulled_V);
        csv += fmt::format("{},{},{},{}\n", cycle, load_N, excitation_V,
                           0.05 + bent_V * (excited ? excitation_V / 5 : 1) + 2e-5 * scatter(random));
      }
    }
    return csv;
  }
  Explanation explained_cell(const std::string& csv) {
    const Observations o = observed(csv,
                                    "blocks = \"cycle\"\n[response]\ncolumn = \"U\"\nunit = \"V\"\n"
                                    "[[covariates]]\ncolumn = \"load\"\nunit = \"N\"\n"
                                    "[[covariates]]\ncolumn = \"E\"\nunit = \"V\"\n"
                                    "meaning = \"excitation_voltage_V\"\n",
                                    "linear:load");
    effects_.emplace(o, test::every_effect());  // a cell's bend per volt
    return explain(o, effects_->all, test::quick());
  }

  /// NaN where it is not named; whichever is found first.
  static double amplitude_of(const std::string& name, const Explanation& e) {
    for (const AdoptedEffect& adopted : e.adopted)
      if (adopted.term.effect->name == name) return adopted.parameters[0].value;
    return std::numeric_limits<double>::quiet_NaN();
  }

 private:
  std::optional<TableEffects> effects_;  // an explanation points to them
};

/// Blades that gain with the Reynolds number do so in both directions: the product is no third effect.
TEST_F(ProductsOfEffectsTest, WhatBothDirectionsAndTheReynoldsNumberDoTogetherIsTheirProduct) {
  std::string csv = "b,N,y\n";
  for (int r = 0; r < 240; ++r) {
    const double rpm = 800 + 3200 * even(random);
    const double full_N = 40 * std::pow(rpm / 3000, 2) * std::pow(rpm / 2500, 0.1);
    csv += fmt::format("{},{},{}\n", r / 10, rpm,
                       (r % 2 == 0 ? full_N : -0.8 * full_N) + 0.02 * scatter(random));
  }
  const Explanation e =
      explained(observed(csv,
                         "blocks = \"b\"\n[response]\ncolumn = \"y\"\nunit = \"N\"\nmeaning = "
                         "\"thrust_N\"\n[speed]\ncolumn = \"N\"\nunit = \"rpm\"\n"));
  EXPECT_EQ(e.adopted.size(), 2u);
  EXPECT_EQ(e.verdict, "explained") << explanation_text(e);
  EXPECT_NEAR(amplitude_of("bidirectional", e), -0.2, 0.001);
  EXPECT_NEAR(amplitude_of("reynolds_number", e), 0.1, 0.001);
}

/// What a cell does beside its line has names, and volts bend per volt.
TEST_F(ProductsOfEffectsTest, OfACellThatPushesLessAndBends) {
  const Explanation e = explained_cell(cell(false));
  EXPECT_EQ(e.adopted.size(), 2u);
  EXPECT_EQ(e.verdict, "explained") << explanation_text(e);
  EXPECT_NEAR(amplitude_of("bidirectional", e), kAsymmetry, 0.001);
  EXPECT_NEAR(amplitude_of("nonlinearity", e), kBend_per_V, 0.001);
  EXPECT_THAT(explanation_text(e), testing::HasSubstr(" 1/V "));
}

/// Twice the excitation reads twice as much, and the cell is bent as before.
TEST_F(ProductsOfEffectsTest, TheExcitationScalesWhatTheCellMadeOfItsLoad) {
  const Explanation e = explained_cell(cell(true));
  EXPECT_EQ(e.verdict, "explained") << explanation_text(e);
  EXPECT_LT(e.after.held_out_rmse, 4e-5);
}

}  // namespace
}  // namespace tunnelrig
