// The random part of the model against dense algebra.
#include "analysis/residual/likelihood/mixed_model.h"

#include "analysis/residual/likelihood/session_directions.h"
#include "analysis/residual/scatter/run_correlation.h"
#include "analysis/residual/simulated.h"
#include "support/seeds.h"

#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

struct Case {
  int channels;
  std::array<double, 2> run_correlation;
  bool runs_unlike = false;

  friend std::ostream& operator<<(std::ostream& out, const Case& c) {
    return out << c.channels << " channels, " << c.run_correlation[0] << " and " << c.run_correlation[1]
               << (c.runs_unlike ? ", runs unlike each other" : "");
  }
};

/// Unequal blocks and groups; some runs are left out, as by a seal.
struct MixedModelTest : testing::TestWithParam<Case> {
  std::mt19937_64 random{test::seed()};
  Observations observations = test::simulate(
      {.runs_of_block = {3, 7, 1, 5, 2, 6, 4}, .groups = 4, .channels = GetParam().channels, .shapes = 1},
      random);
  std::vector<int> rows, others;

  MixedModelTest() {
    observations.scatter.run_correlation = GetParam().run_correlation;
    if (GetParam().runs_unlike) {
      observations.scatter.runs = (0.5 * draw(observations.rows(), 1)).array().exp();
      observations.scatter.by_condition.runs = (0.5 * draw(observations.rows(), 1)).array().exp();
    }
    for (int row = 0; row < static_cast<int>(observations.rows()); ++row)
      (row > 4 && row % 5 == 0 ? others : rows).push_back(row);
  }

  MatrixXd draw(Index n, Index columns) {
    std::normal_distribution<double> normal;
    return MatrixXd::NullaryExpr(n, columns, [&] { return normal(random); });
  }
  /// V of a stratum over σ².
  MatrixXd covariance(const MixedModel& model, std::size_t stratum, std::size_t ratio) const {
    const MixedModel::Stratum& s = model.strata()[stratum];
    const double correlation = s.means() ? GetParam().run_correlation[s.side()] : 0;
    const MatrixXd runs = test::dense_covariance(observations, rows, 0, correlation),
                   sessions = test::dense_covariance(observations, rows, kRatios[ratio], correlation) - runs;
    const VectorXd own = scatter(s.means());
    return own.asDiagonal() * runs * own.asDiagonal() + sessions;
  }
  VectorXd scatter(bool means) const {
    VectorXd result = VectorXd::Ones(static_cast<Index>(rows.size()));
    if (means && GetParam().runs_unlike)
      result = observations.scatter.runs(rows).cwiseProduct(observations.scatter.by_condition.runs(rows));
    return result;
  }
  static MatrixXd part(const MatrixXd& stacked, Index n, Index mode) {
    return stacked.middleRows(mode * n, n);
  }
};

TEST_P(MixedModelTest, StrataAreCommonAndDifferenceModesOfEveryComponent) {
  const MixedModel model(observations, rows);
  ASSERT_EQ(model.strata().size(), GetParam().channels == 1 ? 2u : 4u);
  Index modes = 0;
  for (std::size_t s = 0; s < model.strata().size(); ++s) {
    modes += model.strata()[s].modes;
    const auto fixed = model.strata()[s].means() ? 4 : 0;
    EXPECT_EQ(model.dof(s), model.strata()[s].modes * (static_cast<Index>(rows.size()) - fixed));
  }
  EXPECT_EQ(modes, 2 * GetParam().channels);
  const MatrixXd& q = model.mode_matrix();
  EXPECT_LT((q.transpose() * q - MatrixXd::Identity(q.rows(), q.cols())).norm(), 1e-12);
  EXPECT_LT((q.col(0).array() - 1 / std::sqrt(GetParam().channels)).matrix().norm(), 1e-12);
}

TEST_P(MixedModelTest, WhiteningIsARootOfTheInverseCovariance) {
  const MixedModel model(observations, rows);
  const auto n = static_cast<Index>(rows.size());
  for (std::size_t s = 0; s < model.strata().size(); ++s) {
    for (std::size_t ratio = 0; ratio < model.ratios(); ++ratio) {
      MatrixXd root = MatrixXd::Identity(n, n);
      whiten(model.blocks(), scatter(model.strata()[s].means()), kRatios[ratio], model.run_correlation(s),
             root);
      EXPECT_LT((root.transpose() * root - covariance(model, s, ratio).inverse()).norm(), 1e-10)
          << "stratum " << s << ", ratio " << kRatios[ratio];
    }
  }
}

TEST_P(MixedModelTest, WhitenedSimulationsHaveTheIdentityAsCovariance) {
  const MixedModel model(observations, rows);
  constexpr std::size_t kSets = 20000;
  const double sigma = 0.3;
  for (std::size_t s = 0; s < model.strata().size(); ++s) {
    for (const std::size_t ratio : {std::size_t{0}, std::size_t{5}}) {
      Stacked data = model.simulate(s, std::vector<double>(kSets, sigma),
                                    std::vector<std::size_t>(kSets, ratio), model.run_correlation(s), random);
      const auto n = static_cast<Index>(rows.size());
      Eigen::Map<MatrixXd> by_mode(data.data(), n, data.size() / n);
      whiten(model.blocks(), scatter(model.strata()[s].means()), kRatios[ratio], model.run_correlation(s),
             by_mode);
      const MatrixXd covariance = data * data.transpose() / (sigma * sigma * kSets);
      const MatrixXd excess = covariance - MatrixXd::Identity(data.rows(), data.rows());
      // standard errors 1/√N off the diagonal and √(2/N) on it
      EXPECT_LT(excess.cwiseAbs().maxCoeff(), 5.5 * std::sqrt(2.0 / kSets)) << "ratio " << kRatios[ratio];
    }
  }
}

TEST_P(MixedModelTest, ProjectionTakesOutWhatTheBaselineCanAbsorb) {
  observations.slopes = draw(observations.rows(), 1);
  const MixedModel model(observations, rows);
  const auto n = static_cast<Index>(rows.size());
  const MatrixXd x = test::dense_baseline(observations, rows, rows);
  for (std::size_t s = 0; s < model.strata().size(); ++s) {
    if (!model.strata()[s].means()) continue;
    for (std::size_t ratio = 0; ratio < model.ratios(); ++ratio) {
      Stacked absorbed = x.replicate(model.strata()[s].modes, 1);
      model.project(s, ratio, absorbed);
      EXPECT_LT(absorbed.norm(), 1e-10);

      const MatrixXd y = draw(n, 3);
      Stacked projected = y.replicate(model.strata()[s].modes, 1);
      model.project(s, ratio, projected);
      const MatrixXd v = covariance(model, s, ratio);
      // whichever root it is of which the columns are left, their products are yᵀ P y
      const MatrixXd vx = v.ldlt().solve(x), vy = v.ldlt().solve(y);
      const MatrixXd products =
          y.transpose() * vy - vy.transpose() * x * (x.transpose() * vx).inverse() * x.transpose() * vy;
      for (Index mode = 0; mode < model.strata()[s].modes; ++mode) {
        const MatrixXd left = part(projected, n, mode);
        EXPECT_LT((left.transpose() * left - products).norm(), 1e-9);
      }
    }
  }
}

TEST_P(MixedModelTest, LogDeterminantsAreDenseOnes) {
  const MixedModel model(observations, rows);
  const MatrixXd x = test::dense_baseline(observations, rows, rows);
  for (std::size_t s = 0; s < model.strata().size(); ++s)
    for (std::size_t ratio = 0; ratio < model.ratios(); ++ratio) {
      const MatrixXd v = covariance(model, s, ratio);
      double expected = std::log(v.determinant());
      if (model.strata()[s].means()) expected += std::log((x.transpose() * v.ldlt().solve(x)).determinant());
      EXPECT_NEAR(model.log_determinant(s, ratio), 0.5 * model.strata()[s].modes * expected, 1e-9);
    }
}

TEST_P(MixedModelTest, BaselinePredictsAsDenseGeneralisedLeastSquares) {
  observations.slopes = draw(observations.rows(), 1);
  const MixedModel model(observations, rows);
  const auto n = static_cast<Index>(rows.size()), wanted = static_cast<Index>(others.size());
  const MatrixXd x = test::dense_baseline(observations, rows, rows),
                 x_new = test::dense_baseline(observations, rows, others);
  for (std::size_t s = 0; s < model.strata().size(); ++s)
    for (std::size_t ratio = 0; ratio < model.ratios(); ++ratio) {
      const Index modes = model.strata()[s].modes;
      const MatrixXd y = draw(n * modes, 2);
      const MatrixXd prediction = model.baseline_prediction(s, ratio, y, others);
      const VectorXd variance = model.baseline_variance(s, ratio, others);
      ASSERT_EQ(prediction.rows(), wanted * modes);
      if (!model.strata()[s].means()) {
        EXPECT_EQ(prediction.norm(), 0);
        EXPECT_EQ(variance.norm(), 0);
        continue;
      }
      const MatrixXd v = covariance(model, s, ratio);
      const MatrixXd information = x.transpose() * v.ldlt().solve(x);
      for (Index mode = 0; mode < modes; ++mode) {
        const MatrixXd expected =
            x_new * information.ldlt().solve(x.transpose() * v.ldlt().solve(part(y, n, mode)));
        EXPECT_LT((part(prediction, wanted, mode) - expected).norm(), 1e-9);
      }
      EXPECT_LT((variance - (x_new * information.inverse() * x_new.transpose()).diagonal()).norm(), 1e-9);
    }
}

TEST_P(MixedModelTest, AGroupThatTheModelDoesNotHoldIsNotPredicted) {
  std::erase_if(rows, [&](int row) { return observations.group[static_cast<std::size_t>(row)] == 2; });
  const MixedModel model(observations, rows);
  const auto all = observations.all_rows();
  const MatrixXd y = draw(static_cast<Index>(rows.size()) * model.strata()[0].modes, 1);
  const MatrixXd prediction = model.baseline_prediction(0, 3, y, all);
  const VectorXd variance = model.baseline_variance(0, 3, all);
  for (Index r = 0; r < observations.rows(); ++r) {
    const bool unseen = observations.group[static_cast<std::size_t>(r)] == 2;
    EXPECT_EQ(std::isnan(prediction(r, 0)), unseen);
    EXPECT_EQ(std::isnan(variance(r)), unseen);
  }
}

TEST(MixedModel, StackingRotatesTheRotorsIntoModes) {
  std::mt19937_64 random(test::seed());
  const Observations observations = test::simulate({.channels = 4}, random);
  const std::vector<int> rows = {1, 4, 7};
  const MixedModel model(observations, rows);
  const Components y = {observations.y};
  for (Index r = 0; r < 3; ++r) {
    const Eigen::RowVectorXd run = observations.y.row(rows[static_cast<std::size_t>(r)]);
    EXPECT_NEAR(model.stack(0, {&y})(r, 0), run.sum() / 2, 1e-12) << "the common mode is the mean times √4";
    const Stacked differences = model.stack(1, {&y});
    double squares = 0;
    for (Index mode = 0; mode < 3; ++mode) squares += std::pow(differences(mode * 3 + r, 0), 2);
    EXPECT_NEAR(squares, (run.array() - run.mean()).square().sum(), 1e-12);
  }
}

TEST(MixedModel, BlocksOfSingleRowsHaveOneRatio) {
  std::mt19937_64 random(test::seed());
  Observations observations = test::simulate({.runs_of_block = std::vector<int>(20, 1)}, random);
  observations.blocks_are_rows = true;
  EXPECT_EQ(MixedModel(observations, observations.all_rows()).ratios(), 1u);
}

/// By directions, as of few blocks, and by equations solved at each ratio, as of many.
TEST_P(MixedModelTest, SessionVarianceChangesProductsAsAProjectionAtItDoes) {
  observations.slopes = draw(observations.rows(), 1);
  const MixedModel model(observations, rows);
  for (std::size_t s = 0; s < model.strata().size(); ++s) {
    const Stacked columns = draw(static_cast<Index>(rows.size()) * model.strata()[s].modes, 3);
    Stacked at_0 = columns;
    model.project(s, 0, at_0);
    for (const Index most_blocks : {Index{0}, SessionDirections::kMostBlocks}) {
      const SessionDirections sessions(model, s, most_blocks);
      const Stacked coordinates = sessions.coordinates(at_0);
      for (std::size_t ratio = 0; ratio < model.ratios(); ++ratio) {
        Stacked projected = columns;
        model.project(s, ratio, projected);
        const MatrixXd products =
            at_0.transpose() * at_0 - coordinates.transpose() * sessions.weighted(ratio, coordinates);
        EXPECT_LT((products - projected.transpose() * projected).norm(), 1e-11 * products.norm())
            << "stratum " << s << ", ratio " << kRatios[ratio] << ", directions of " << most_blocks;
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Rotors, MixedModelTest,
                         testing::Values(Case{1, {0, 0}}, Case{4, {0, 0}}, Case{1, {0.6, 0}},
                                         Case{4, {0.3, 0.6}}, Case{4, {0.4, 0.4}}, Case{1, {0, 0}, true},
                                         Case{4, {0.3, 0.6}, true}));

/// Estimated through everything that the baseline takes from the data.
TEST(RunCorrelation, IsFoundWhereItIsAndNowhereElse) {
  SCOPED_TRACE(testing::Message() << "seed " << test::seed());
  std::mt19937_64 random(test::seed());
  constexpr int kCampaigns = 40;
  for (const double truth : {0.0, 0.5}) {
    double mean = 0;
    int found = 0;
    for (int i = 0; i < kCampaigns; ++i) {
      Observations o =
          test::simulate({.runs_of_block = std::vector<int>(13, 12), .groups = 40, .channels = 4}, random);
      const MixedModel model(o, o.all_rows());
      const Components y = {o.y};
      NullFit fit = CandidateScan(model, {}, {}).null_fit(y);
      const Stacked drawn = model.simulate(1, {1.0}, {fit.ratio[1]}, truth, random);
      // the difference modes' data, turned back into rotors
      const Eigen::Map<const Eigen::MatrixXd> modes(drawn.data(), o.rows(), 3);
      const Components rotors = {modes * model.mode_matrix().rightCols(3).transpose()};
      const double correlation = run_correlation(o, model, fit, rotors, random)[1];
      mean += correlation / kCampaigns;
      found += correlation > 0 ? 1 : 0;
    }
    EXPECT_NEAR(mean, truth, 0.06);
    if (truth == 0) {
      EXPECT_LE(found, 6) << "2.5 % of 40 are expected";
    } else {
      EXPECT_EQ(found, kCampaigns);
    }
  }
}

/// A model of independent runs takes a part of the correlation for sessions that differ.
TEST(RunCorrelation, IsNotHiddenByTheSessionVarianceOfIndependentRuns) {
  SCOPED_TRACE(testing::Message() << "seed " << test::seed());
  std::mt19937_64 random(test::seed());
  constexpr int kCampaigns = 40;
  constexpr double kTruth = 0.6;
  std::array<double, 2> mean = {0, 0};
  for (int i = 0; i < kCampaigns; ++i) {
    const Observations o = test::simulate({.runs_of_block = std::vector<int>(18, 12),
                                           .groups = 26,
                                           .channels = 4,
                                           .session_ratio = 0,
                                           .run_correlation = kTruth},
                                          random);
    const MixedModel model(o, o.all_rows());
    const Components y = {o.y};
    const std::array<double, 2> found =
        run_correlation(o, model, CandidateScan(model, {}, {}).null_fit(y), y, random);
    for (std::size_t side = 0; side < 2; ++side) mean[side] += found[side] / kCampaigns;
  }
  EXPECT_NEAR(mean[0], kTruth, 0.06) << "of one mode the standard error is 0.015";
  EXPECT_NEAR(mean[1], kTruth, 0.03);
}

/// The leverage is the diagonal of the baseline's hat matrix, in whitened responses.
TEST(MixedModel, LeverageIsThatOfDenseAlgebra) {
  std::mt19937_64 random{test::seed()};
  for (const double correlation : {0.0, 0.6})
    for (const std::size_t ratio : {0U, 4U}) {
      Observations o = test::simulate({.runs_of_block = {5, 1, 7, 6}, .groups = 4}, random);
      o.scatter.run_correlation = {correlation, correlation};
      o.scatter.runs = VectorXd::LinSpaced(o.rows(), 0.7, 1.4);
      const auto rows = o.all_rows();
      MatrixXd x = test::dense_baseline(o, rows, rows);
      whiten(without_numbers(places_of_each(o.block, rows)), o.scatter.of_runs(rows), kRatios[ratio],
             correlation, x);
      const MatrixXd hat = x * x.completeOrthogonalDecomposition().pseudoInverse();
      EXPECT_LT((MixedModel(o, rows).baseline_leverage(0, ratio) - hat.diagonal()).norm(), 1e-10)
          << correlation << ' ' << kRatios[ratio];
    }
}

/// As far as a run is from what the others say of it: alike for all of a block, however they resemble each
/// other.
TEST(MixedModel, SizesThatAreLeftAreAlikeWhereRunsAre) {
  std::mt19937_64 random{test::seed()};
  constexpr int kBlocks = 12, kRuns = 12, kSets = 40;
  for (const double correlation : {0.0, 0.5, 0.8}) {
    Observations o = test::simulate({.runs_of_block = std::vector<int>(kBlocks, kRuns), .groups = 1}, random);
    o.scatter.run_correlation = {correlation, correlation};
    const MixedModel model(o, o.all_rows());
    double first = 0, others = 0;
    for (int set = 0; set < kSets; ++set) {
      const Components residual = {MatrixXd(model.simulate_unit(0, 0, 1, correlation, random))};
      const Components candidate = {MatrixXd(model.simulate_unit(0, 0, 1, 0, random))};
      const MatrixXd sizes = model.sizes_left({0}, {1.0}, residual, {candidate}, VectorXd::Zero(1), {})[0];
      for (Eigen::Index run = 0; run < sizes.rows(); ++run)
        (run % kRuns == 0 ? first : others) += std::pow(sizes(run, 0), 2);
    }
    EXPECT_NEAR(std::sqrt(first / (kBlocks * kSets)), 1, 0.15) << correlation;
    EXPECT_NEAR(std::sqrt(others / (kBlocks * (kRuns - 1) * kSets)), 1, 0.05) << correlation;
  }
}

}  // namespace
}  // namespace tunnelrig
