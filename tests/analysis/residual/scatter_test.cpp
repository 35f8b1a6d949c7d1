// Scatter that is not the same everywhere: a rotor's own, and runs that belong to no scatter.
#include "analysis/report/explanation_page.h"
#include "analysis/residual/explanation/explanation_output.h"
#include "analysis/residual/explanation/explanation_parts.h"
#include "analysis/residual/scatter/contrast_scatter.h"
#include "analysis/residual/scatter/rotor_scatter.h"
#include "analysis/residual/scatter/rotor_sessions.h"
#include "analysis/residual/simulated.h"
#include "support/seeds.h"

#include <algorithm>

#include <fmt/format.h>
#include <gmock/gmock.h>

namespace tunnelrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using test::explained;

constexpr double kRunSigma = 0.002;

struct Scatter : testing::Test {
  std::mt19937_64 random{test::seed()};

  Observations observations() { return test::four_rotors(3, kRunSigma, random); }

  /// `times` the others' scatter from run to run.
  void let_scatter_more(Observations& o, Index rotor, double times) {
    std::normal_distribution<double> normal(0, kRunSigma * std::sqrt(times * times - 1));
    MatrixXd y = o.y;
    for (Index row = 0; row < y.rows(); ++row) y(row, rotor) += normal(random);
    test::set_y(o, y);
  }

  VectorXd found(const Observations& o) { return rotor_scatter(o, o.all_rows(), {o.y}, random); }
};

/// Own scatters and a part that is the same in all: the modes are uncorrelated, the differences alike.
TEST_F(Scatter, ModesMakeRotorsAlike) {
  Observations o = observations();
  o.scatter.rotors.resize(4);
  o.scatter.rotors << 0.5, 1, 3, 0.8;
  const MixedModel model(o, o.all_rows());
  const MatrixXd& modes = model.mode_matrix();
  MatrixXd covariance = MatrixXd::Constant(4, 4, 2.0);
  covariance.diagonal() += o.scatter.rotors.cwiseAbs2();
  const MatrixXd of_modes = modes.transpose() * covariance * modes;
  EXPECT_LT((of_modes - MatrixXd(of_modes.diagonal().asDiagonal())).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_LT((of_modes.diagonal().tail(3).array() - 1).abs().maxCoeff(), 1e-12);
  const Eigen::RowVectorXd alike = Eigen::RowVectorXd::Ones(4) * modes;
  EXPECT_GT(alike(0), 0);
  EXPECT_LT(alike.tail(3).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_LT((modes * model.rotors_of_modes() - MatrixXd::Identity(4, 4)).cwiseAbs().maxCoeff(), 1e-12);
}

/// A roll that differs from run to run: rotors 1 and 4 against 2 and 3, in σ of a rotor's own scatter.
void let_roll(Observations& o, double times, std::mt19937_64& random) {
  std::normal_distribution<double> normal(0, times * kRunSigma);
  const Eigen::RowVector4d sides(1, -1, -1, 1);
  MatrixXd y = o.y;
  for (Index row = 0; row < y.rows(); ++row) y.row(row) += normal(random) * sides;
  test::set_y(o, y);
}

TEST_F(Scatter, OfARollIsFoundAndIsNotThatOfRotors) {
  constexpr int kCampaigns = 40;
  int alike_differ = 0, of_a_rotor = 0, found_of_roll = 0;
  for (int i = 0; i < kCampaigns; ++i) {
    Observations o = observations(), one_rotor = o;
    const auto unlike = [&](const Observations& of) {
      return contrast_scatter(of, of.all_rows(), {of.y}, random);
    };
    alike_differ += unlike(o).size() > 0 ? 1 : 0;
    let_scatter_more(one_rotor, 2, 4);
    of_a_rotor += unlike(one_rotor).size() > 0 ? 1 : 0;
    let_roll(o, 1.5, random);
    const VectorXd scatter = unlike(o);
    if (scatter.size() == 0) continue;
    ++found_of_roll;
    EXPECT_NEAR(scatter.prod(), 1, 1e-9);
    EXPECT_NEAR(scatter(2) / std::sqrt(scatter(0) * scatter(1)), std::sqrt(1 + 4 * 1.5 * 1.5), 1);
  }
  EXPECT_LE(alike_differ, 3) << "0.5 % of 40 are expected";
  EXPECT_LE(of_a_rotor, 3);
  EXPECT_EQ(found_of_roll, kCampaigns);
}

TEST_F(Scatter, OfARollIsSaidAndIsNoStructure) {
  Observations o = observations();
  let_roll(o, 1.5, random);
  const Explanation e = explained(o);
  EXPECT_EQ(e.verdict, "no_structure");
  EXPECT_THAT(e.warnings, testing::Contains(testing::HasSubstr("1 + 4 − 2 − 3: 2.")));
  EXPECT_THAT(e.warnings, testing::Each(testing::Not(testing::StartsWith("rotors scatter"))));
  EXPECT_GT(without_set_aside(o, e).scatter.contrasts.size(), 0)
      << "a model that is adopted is fitted with it";
}

/// A drift of rotors 1 and 2 against 3 and 4, smaller than the roll.
TEST_F(Scatter, OfARollDoesNotHideWhatIsElsewhere) {
  Observations o = observations();
  let_roll(o, 3, random);
  const VectorXd voltage = o.find("supply_voltage_V")->value.col(0);
  MatrixXd y = o.y;
  y.leftCols(2).array().colwise() += 1.8 * kRunSigma * (voltage.array() - 16);
  y.rightCols(2).array().colwise() -= 1.8 * kRunSigma * (voltage.array() - 16);
  test::set_y(o, y);
  const Explanation e = explained(o);
  const bool named = std::ranges::any_of(e.adopted, [](const AdoptedEffect& adopted) {
    return std::ranges::count(adopted.term.effect->covariates, "supply_voltage_V") > 0;
  });
  const bool curved = std::ranges::any_of(
      e.unknown, [](const UnknownStructure& found) { return found.covariate == "supply_voltage_V"; });
  EXPECT_TRUE(named || curved) << explanation_text(e);
}

/// Of the third rotor, over the others' geometric mean.
double over_others(const VectorXd& scatter) {
  return scatter(2) / std::cbrt(scatter(0) * scatter(1) * scatter(3));
}

TEST_F(Scatter, OfOneRotorIsFoundAndOfAlikeRotorsNot) {
  constexpr int kCampaigns = 40;
  int alike_differ = 0, differ = 0;
  double ratio = 0;
  for (int i = 0; i < kCampaigns; ++i) {
    Observations o = observations();
    alike_differ += found(o).size() > 0 ? 1 : 0;
    let_scatter_more(o, 2, 4);
    const VectorXd scatter = found(o);
    if (scatter.size() == 0) continue;
    ++differ;
    EXPECT_NEAR(scatter.prod(), 1, 1e-9);
    ratio += over_others(scatter) / kCampaigns;
  }
  EXPECT_LE(alike_differ, 3) << "0.5 % of 40 are expected";
  EXPECT_EQ(differ, kCampaigns);
  EXPECT_NEAR(ratio, 4, 0.6);
}

TEST_F(Scatter, OfACellThatIsLooseIsMeasuredAsWell) {
  Observations o = observations();
  let_scatter_more(o, 2, 30);
  const VectorXd scatter = found(o);
  ASSERT_EQ(scatter.size(), 4);
  EXPECT_NEAR(over_others(scatter), 26, 9) << "30, but what others vary by from session to session is theirs";
}

TEST_F(Scatter, OfOneRotorIsSaidAndIsNoStructure) {
  Observations o = observations();
  let_scatter_more(o, 2, 4);
  const Explanation e = explained(o);
  EXPECT_EQ(e.verdict, "no_structure");
  EXPECT_THAT(e.warnings, testing::Contains(testing::HasSubstr("rotors scatter unlike each other")));
  EXPECT_TRUE(e.suspect_rows.empty()) << "its runs are judged by its own scatter";
  EXPECT_GT(without_set_aside(o, e).scatter.rotors.size(), 0) << "a model that is adopted is fitted with it";
}

TEST_F(Scatter, OfOneRotorDoesNotHideAnEffectOnIt) {
  Observations o = observations();
  let_scatter_more(o, 2, 4);
  const VectorXd voltage = o.find("supply_voltage_V")->value.col(0);
  MatrixXd y = o.y;
  y.col(2).array() += 3 * 4 * kRunSigma * (voltage.array() - 16);  // about 0.9 of its own scatter
  test::set_y(o, y);
  const Explanation e = explained(o);
  std::vector<int> rotors;
  for (const AdoptedEffect& adopted : e.adopted) rotors.push_back(adopted.term.rotor);
  for (const UnknownStructure& unknown : e.unknown) rotors.push_back(unknown.rotor);
  EXPECT_EQ(rotors, std::vector<int>{2});
}

/// A tare that repeats badly: an offset for each session, of one rotor alone.
void let_sessions_differ_more(Observations& o, Index rotor, double sigma, std::mt19937_64& random) {
  std::normal_distribution<double> normal(0, sigma);
  VectorXd offset(o.blocks());
  for (double& each : offset) each = normal(random);
  MatrixXd y = o.y;
  y.col(rotor) += offset(o.block);
  test::set_y(o, y);
}

/// The modes are those in which runs as well as sessions are uncorrelated.
TEST_F(Scatter, OfOneRotorsSessionsHasAModeOfItsOwn) {
  constexpr int kCampaigns = 40;
  int alike_differ = 0, differ = 0;
  double correlation = 0;  // of sessions in the two modes
  for (int i = 0; i < kCampaigns; ++i) {
    Observations o = observations();
    const auto rows = o.all_rows();
    alike_differ += rotor_sessions(o, rows, {o.y}, random).rotors.empty() ? 0 : 1;
    let_sessions_differ_more(o, 2, 3 * kRunSigma, random);
    o.scatter.sessions = rotor_sessions(o, rows, {o.y}, random);
    differ += o.scatter.sessions.rotors == std::vector{2} ? 1 : 0;
    if (o.scatter.sessions.rotors != std::vector{2}) continue;
    const MixedModel model(o, rows);
    ASSERT_EQ(model.strata().size(), 3u);
    EXPECT_EQ(model.strata()[2].modes, 2);
    EXPECT_LT(model.mode_matrix().row(2).tail(2).norm(), 1e-9)
        << "the others' differences have no part of it";
    const MatrixXd modes = model.mode_matrix();
    EXPECT_LT((modes * model.rotors_of_modes() - MatrixXd::Identity(4, 4)).cwiseAbs().maxCoeff(), 1e-9);
    MatrixXd of_sessions = MatrixXd::Identity(4, 4) * 0.4;
    of_sessions(2, 2) += 9;
    const MatrixXd c = modes.transpose() * of_sessions * modes;
    correlation += std::abs(c(0, 1)) / std::sqrt(c(0, 0) * c(1, 1)) / kCampaigns;
  }
  EXPECT_LT(correlation, 0.3) << "the rotors' mean and the third against the others: 0.9";
  EXPECT_LE(alike_differ, 3) << "0.5 % of 40 are expected";
  EXPECT_GE(differ, kCampaigns - 2);
}

/// With one variance for all that rotors differ by, half of such campaigns have structure.
TEST_F(Scatter, OfOneRotorsSessionsIsNoEffect) {
  constexpr int kCampaigns = 24;
  int structure = 0, said = 0;
  for (int i = 0; i < kCampaigns; ++i) {
    Observations o = observations();
    test::add_covariate(o, "air_pressure_Pa", 99000, 103000, random);
    test::add_covariate(o, "relative_humidity", 0.3, 0.7, random);
    for (std::size_t k = o.covariates.size() - 2; k < o.covariates.size(); ++k) {
      MatrixXd& of_day = o.covariates[k].value;
      for (Index row = 1; row < o.rows(); ++row)
        if (o.block[static_cast<std::size_t>(row)] == o.block[static_cast<std::size_t>(row - 1)])
          of_day(row) = of_day(row - 1);
    }
    let_sessions_differ_more(o, i % 4, 2.5 * kRunSigma, random);
    const Explanation e = explained(o);
    for (const std::string& warning : e.warnings)
      said += warning.starts_with(fmt::format("sessions of rotor {} differ", i % 4 + 1)) ? 1 : 0;
    structure += e.adopted.empty() && (e.unknown.empty() || e.unknown[0].covariate == "session") ? 0 : 1;
    if (e.unknown.empty() || e.unknown[0].covariate != "session") continue;
    EXPECT_EQ(e.unknown[0].rotor, i % 4);
    EXPECT_THAT(explanation_html(e, o, {}, {}),
                testing::HasSubstr(fmt::format("unknown: session of rotor {}", i % 4 + 1)));
  }
  EXPECT_LE(structure, 4) << "binomial (24, 0.06): beyond 4 in 0.6 % of cases";
  EXPECT_GE(said, kCampaigns - 3);
}

TEST_F(Scatter, AGrossRunIsSuspectAndNamesNothing) {
  for (const double wrong : {0.02, 0.5}) {  // 10 σ and 250 σ
    Observations o = observations();
    MatrixXd y = o.y;
    y(77, 2) += wrong;
    test::set_y(o, y);
    const Explanation e = explained(o);
    ASSERT_EQ(e.suspect_rows.size(), 1u) << wrong;
    EXPECT_EQ(e.suspect_rows[0].row, o.name[77]);
    EXPECT_GT(e.suspect_rows[0].studentised, 5) << "measured above predicted";
    EXPECT_EQ(e.suspect_rows[0].set_aside, wrong > 0.1);
    EXPECT_EQ(e.runs, wrong > 0.1 ? 127 : 128);
    EXPECT_EQ(e.verdict, "no_structure") << wrong;
  }
}

TEST_F(Scatter, OfOneLocationIsFoundAndSaidAndIsNoStructure) {
  constexpr int kCampaigns = 12;
  int said = 0, structure = 0, alike_differ = 0;
  for (int i = 0; i < kCampaigns; ++i) {
    Observations o = test::simulate({.runs_of_block = std::vector<int>(16, 8),
                                     .groups = 8,
                                     .channels = 4,
                                     .sigma = kRunSigma,
                                     .session_ratio = 0.4},
                                    random);
    test::add_covariate(o, "supply_voltage_V", 15.5, 16.5, random);
    const auto warned = [](const Explanation& e) {
      return std::any_of(e.warnings.begin(), e.warnings.end(), [](const std::string& warning) {
        return warning.find("scatter more than most") != warning.npos;
      });
    };
    alike_differ += warned(explained(o)) ? 1 : 0;
    std::normal_distribution<double> normal(0, 8 * kRunSigma);
    MatrixXd y = o.y;
    for (Index row = 0; row < y.rows(); ++row)
      for (Index c = 0; c < 4 && o.group[static_cast<std::size_t>(row)] == 3; ++c)
        y(row, c) += normal(random);
    test::set_y(o, y);
    const Explanation e = explained(o);
    if (warned(e)) {
      ++said;
      EXPECT_THAT(e.warnings, testing::Contains(testing::HasSubstr(" at " + o.group_name[3] + " scatter")));
    }
    structure += e.verdict == "no_structure" ? 0 : 1;
  }
  EXPECT_LE(alike_differ, 1);
  EXPECT_GE(said, kCampaigns - 1);
  EXPECT_LE(structure, 2);
}

/// Each makes the variance that the others are held against.
TEST_F(Scatter, SeveralGrossRunsDoNotHideEachOther) {
  Observations o = observations();
  MatrixXd y = o.y;
  const std::vector<Index> wrong = {11, 50, 77, 78, 120};
  for (const Index row : wrong) y(row, row % 4) -= 0.7;  // half the thrust
  test::set_y(o, y);
  const Explanation e = explained(o);
  ASSERT_EQ(e.suspect_rows.size(), wrong.size());
  for (std::size_t k = 0; k < wrong.size(); ++k) {
    EXPECT_EQ(e.suspect_rows[k].row, o.name[static_cast<std::size_t>(wrong[k])]);
    EXPECT_TRUE(e.suspect_rows[k].set_aside);
  }
  EXPECT_EQ(e.verdict, "no_structure");
}

/// Half the speed in a few runs is a quarter of the thrust, and no slip of the hand.
TEST_F(Scatter, WhatAllRotorsDoIsNotWild) {
  Observations o = observations();
  MatrixXd y = o.y;
  for (const Index row : {11, 50, 77}) y.row(row).array() -= 1.4;
  test::set_y(o, y);
  EXPECT_TRUE(wild_runs(o).empty());
  y(50, 1) -= 0.2;
  test::set_y(o, y);
  ASSERT_EQ(wild_runs(o).size(), 1u);
  EXPECT_EQ(wild_runs(o)[0].row, o.name[50]);
}

}  // namespace
}  // namespace tunnelrig
