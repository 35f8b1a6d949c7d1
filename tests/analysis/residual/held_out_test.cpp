// Prediction of runs that the fit did not see.
#include "analysis/residual/likelihood/cross_validation.h"
#include "analysis/residual/simulated.h"
#include "support/seeds.h"

#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Variances that are known: σ and one ratio for all strata.
NullFit known_variances(const Observations& o, double sigma, std::size_t ratio) {
  const std::size_t strata = MixedModel(o, o.all_rows()).strata().size();
  return {.ratio = std::vector<std::size_t>(strata, ratio),
          .sigma = std::vector<double>(strata, sigma),
          .ratio_probability = {}};
}

struct Split {
  std::vector<int> fit, test;
};
/// Every third block is held out; the blocks that first visit the groups stay.
Split split_blocks(const Observations& o) {
  Split split;
  for (const int row : o.all_rows())
    (o.block[static_cast<std::size_t>(row)] % 3 == 1 ? split.test : split.fit).push_back(row);
  return split;
}

MatrixXd normal(Index rows, Index columns, std::mt19937_64& random) {
  std::normal_distribution<double> draw;
  return MatrixXd::NullaryExpr(rows, columns, [&] { return draw(random); });
}

/// Each block a group of its own.
void make_blocks_groups(Observations& o) {
  o.group = o.block;
  o.group_name = o.block_name;
  o.groups_within_blocks = true;
}

double mean_square_over_expected(const HeldOutErrors& errors) {
  const auto z = (errors.error.array() / errors.expected_std.array()).eval();
  return z.isNaN().select(0, z).square().sum() / static_cast<double>(errors.count());
}

/// The mean of values that are 1 on the average, to four standard errors.
void expect_near_1(const VectorXd& values) {
  const double spread = (values.array() - values.mean()).matrix().norm();
  EXPECT_NEAR(values.mean(), 1, 4 * spread / static_cast<double>(values.size()));
}

struct HeldOut : testing::TestWithParam<int> {};

TEST_P(HeldOut, ErrorsAreThoseOfDirectLeastSquares) {
  std::mt19937_64 random(test::seed());
  const int c = GetParam();
  const Observations o = test::simulate(
      {.runs_of_block = {5, 3, 6, 2, 7, 4, 5}, .channels = c, .session_ratio = 0, .multiplicative = false},
      random);
  const Split split = split_blocks(o);
  const std::vector<MatrixXd> columns = {normal(o.rows(), c, random), normal(o.rows(), c, random)};
  const HeldOutErrors errors = predict_held_out(o, {o.y}, {{columns[0]}, {columns[1]}},
                                                known_variances(o, 0.002, 0), split.fit, split.test);

  // one regression for all rotors: a constant for each group and rotor, and the two columns
  const auto design = [&](const std::vector<int>& rows) {
    const MatrixXd x = test::dense_baseline(o, split.fit, rows);
    MatrixXd all = MatrixXd::Zero(x.rows() * c, x.cols() * c + 2);
    for (int channel = 0; channel < c; ++channel) {
      all.block(channel * x.rows(), channel * x.cols(), x.rows(), x.cols()) = x;
      for (Index k = 0; k < 2; ++k)
        all.block(channel * x.rows(), x.cols() * c + k, x.rows(), 1) =
            columns[static_cast<std::size_t>(k)](rows, channel);
    }
    return all;
  };
  const VectorXd y = o.y(split.fit, Eigen::all).reshaped();
  const MatrixXd x = design(split.fit);
  const VectorXd beta = x.colPivHouseholderQr().solve(y);
  const MatrixXd predicted = (design(split.test) * beta).reshaped(static_cast<Index>(split.test.size()), c);
  EXPECT_LT((errors.error - (predicted - o.value(split.test, Eigen::all))).norm(), 1e-9);
  EXPECT_LT((errors.amplitude - beta.tail(2)).norm(), 1e-10);
  EXPECT_EQ(errors.count(), static_cast<Index>(split.test.size()) * c);
  EXPECT_NEAR(errors.loss(), errors.sum_of_squares() / 0.002 / 0.002, 1e-6 * errors.loss());

  const MatrixXd information = (x.transpose() * x).inverse();
  const MatrixXd x_test = design(split.test);
  const VectorXd variance =
      0.002 * 0.002 * (1 + ((x_test * information).array() * x_test.array()).rowwise().sum());
  // over the rotors of a run: how its modes go together is left out of each rotor's share
  const VectorXd expected = variance.reshaped(static_cast<Index>(split.test.size()), c).rowwise().sum();
  EXPECT_LT((errors.expected_std.cwiseAbs2().rowwise().sum() - expected).norm(), 1e-12);
}

TEST_P(HeldOut, RunsThatScatterMoreCountLess) {
  std::mt19937_64 random(test::seed() + 7);
  Observations o =
      test::simulate({.channels = GetParam(), .session_ratio = 0, .multiplicative = false}, random);
  o.scatter.by_condition.runs = normal(o.rows(), 1, random).array().exp();
  const Split split = split_blocks(o);
  const HeldOutErrors errors =
      predict_held_out(o, {o.y}, {}, known_variances(o, 0.002, 0), split.fit, split.test);
  const VectorXd scatter = o.scatter.of_runs(split.test),
                 weight = o.scatter.of_runs(split.fit).cwiseInverse();
  const MatrixXd x = weight.asDiagonal() * test::dense_baseline(o, split.fit, split.fit),
                 x_test = test::dense_baseline(o, split.fit, split.test);
  const MatrixXd y = weight.asDiagonal() * MatrixXd(o.y(split.fit, Eigen::all));
  const MatrixXd predicted = x_test * x.colPivHouseholderQr().solve(y);
  EXPECT_LT((errors.error - (predicted - o.value(split.test, Eigen::all))).norm(), 1e-9);
  const VectorXd of_baseline = (x_test * (x.transpose() * x).inverse() * x_test.transpose()).diagonal();
  const VectorXd expected = 0.002 * (scatter.cwiseAbs2() + of_baseline).cwiseSqrt();
  EXPECT_LT((errors.expected_std - expected.replicate(1, GetParam())).norm(), 1e-9);
  const double loss = (scatter.cwiseInverse().asDiagonal() * errors.error).squaredNorm() / 0.002 / 0.002;
  EXPECT_NEAR(errors.loss(), loss, 1e-9 * loss);
}

TEST_P(HeldOut, MultiplicativeErrorsAreInTheResponsesUnit) {
  std::mt19937_64 random(test::seed() + 1);
  const Observations o = test::simulate({.channels = GetParam(), .session_ratio = 0}, random);
  const Split split = split_blocks(o);
  const HeldOutErrors errors =
      predict_held_out(o, {o.y}, {}, known_variances(o, 0.002, 0), split.fit, split.test);
  const MatrixXd x = test::dense_baseline(o, split.fit, split.fit),
                 x_test = test::dense_baseline(o, split.fit, split.test);
  const MatrixXd y = o.y(split.fit, Eigen::all);
  const MatrixXd predicted = 7.0 * (x_test * x.colPivHouseholderQr().solve(y)).array().exp();
  EXPECT_LT((errors.error - (predicted - o.value(split.test, Eigen::all))).norm(), 1e-9);
}

TEST_P(HeldOut, ExpectedScatterCoversTheErrors) {
  std::mt19937_64 random(test::seed() + 2);
  const std::size_t ratio = 4;  // σ_session = σ_run
  double squares = 0, inside = 0, count = 0;
  std::vector<double> of_campaign;
  for (int i = 0; i < 300; ++i) {
    const Observations o = test::simulate({.runs_of_block = std::vector<int>(9, 4),
                                           .groups = 3,
                                           .channels = GetParam(),
                                           .session_ratio = kRatios[ratio]},
                                          random);
    const Split split = split_blocks(o);
    const MatrixXd column = normal(o.rows(), 1, random).replicate(1, GetParam());
    const HeldOutErrors errors =
        predict_held_out(o, {o.y}, {{column}}, known_variances(o, 0.002, ratio), split.fit, split.test);
    const auto z = (errors.error.array() / errors.expected_std.array()).eval();
    squares += z.square().sum();
    of_campaign.push_back(z.square().mean());
    inside += static_cast<double>((z.abs() < 1.96).count());
    count += static_cast<double>(z.size());
  }
  double spread = 0;  // errors of one campaign go together: its mean counts as one
  for (const double value : of_campaign) spread += std::pow(value - squares / count, 2);
  const double standard_error = std::sqrt(spread) / static_cast<double>(of_campaign.size());
  EXPECT_NEAR(squares / count, 1, 4 * standard_error);
  EXPECT_NEAR(inside / count, 0.95, 0.015);
}

/// A held-out group's constant comes from every other run of it: what neighbours share is in it already.
TEST_P(HeldOut, ExpectedScatterOfAGroupsOwnBaselineKnowsItsNeighbours) {
  std::mt19937_64 random(test::seed() + 8);
  constexpr int kTables = 300;
  VectorXd of_table(kTables);
  for (int i = 0; i < kTables; ++i) {
    Observations o = test::simulate({.runs_of_block = std::vector<int>(9, 8),
                                     .groups = 1,
                                     .channels = GetParam(),
                                     .session_ratio = 0,
                                     .run_correlation = 0.8},
                                    random);
    make_blocks_groups(o);
    o.scatter.run_correlation = {0.8, 0.8};
    const Split split = split_blocks(o);
    const HeldOutErrors errors =
        predict_held_out(o, {o.y}, {}, known_variances(o, 0.002, 0), split.fit, split.test);
    of_table(i) = mean_square_over_expected(errors);
  }
  expect_near_1(of_table);
}

/// So is what runs of one session share, where a group is met in several of them.
TEST_P(HeldOut, ExpectedScatterOfAGroupsOwnBaselineKnowsItsSessions) {
  std::mt19937_64 random(test::seed() + 10);
  const std::size_t ratio = 6;  // sessions scatter more than runs
  constexpr int kTables = 300, kGroups = 9;
  VectorXd of_table(kTables);
  for (int i = 0; i < kTables; ++i) {
    Observations o = test::simulate({.runs_of_block = std::vector<int>(12, 9),
                                     .groups = 1,
                                     .channels = GetParam(),
                                     .session_ratio = kRatios[ratio]},
                                    random);
    Split split;
    o.group_name.clear();
    for (int group = 0; group < kGroups; ++group) o.group_name.push_back(std::to_string(group));
    for (const int row : o.all_rows()) {  // each session has a run of every group
      o.group[static_cast<std::size_t>(row)] = row % kGroups;
      o.held_out.push_back(row % kGroups % 3 == 1);
      (o.held_out.back() ? split.test : split.fit).push_back(row);
    }
    const HeldOutErrors errors =
        predict_held_out(o, {o.y}, {}, known_variances(o, 0.002, ratio), split.fit, split.test);
    of_table(i) = mean_square_over_expected(errors);
  }
  expect_near_1(of_table);
}

/// And its errors have those of the amplitudes, of which the group's own constant takes up none that vary in
/// it.
TEST_P(HeldOut, ExpectedScatterOfAGroupsOwnBaselineHasTheAmplitudes) {
  std::mt19937_64 random(test::seed() + 9);
  constexpr int kTables = 300;
  VectorXd of_table(kTables);
  for (int i = 0; i < kTables; ++i) {
    Observations o = test::simulate(
        {.runs_of_block = std::vector<int>(6, 6), .groups = 1, .channels = GetParam(), .session_ratio = 0},
        random);
    make_blocks_groups(o);
    const Split split = split_blocks(o);
    MatrixXd column = normal(o.rows(), GetParam(), random);
    column(split.test, Eigen::all) *= 5;  // far beyond what the fit has seen
    const HeldOutErrors errors =
        predict_held_out(o, {o.y}, {{column}}, known_variances(o, 0.002, 0), split.fit, split.test);
    of_table(i) = mean_square_over_expected(errors);
  }
  expect_near_1(of_table);
}

/// Runs that one of two models has no errors of are no runs that it predicts without error.
TEST_P(HeldOut, ModelsAreComparedByRunsThatBothPredict) {
  std::mt19937_64 random(test::seed() + 10);
  Observations o = test::simulate(
      {.runs_of_block = std::vector<int>(6, 4), .groups = 1, .channels = GetParam(), .session_ratio = 0},
      random);
  make_blocks_groups(o);
  const auto left_out_errors = [&](const Observations& model) {
    return cross_validate(model, {model.y}, {}, known_variances(model, 0.002, 0), model.all_rows());
  };
  Observations wide = o;  // as many coefficients of each group as it has runs
  wide.slopes = normal(o.rows(), 3, random);
  ASSERT_EQ(left_out_errors(wide).all().count(), 0);
  const LossDifference gain = compare(left_out_errors(o), left_out_errors(wide));
  EXPECT_EQ(gain.mean, 0);
  EXPECT_EQ(gain.expected_standard_error, 0) << "of no runs";
  EXPECT_FALSE(gain.told_apart());
}

TEST_P(HeldOut, GroupsThatOnlyTheHeldOutPartHasAreNotScored) {
  std::mt19937_64 random(test::seed() + 3);
  Observations o = test::simulate({.channels = GetParam()}, random);
  Split split = split_blocks(o);
  std::erase_if(split.fit, [&](int row) { return o.group[static_cast<std::size_t>(row)] == 1; });
  const HeldOutErrors errors =
      predict_held_out(o, {o.y}, {}, known_variances(o, 0.002, 2), split.fit, split.test);
  Index scored = 0;
  for (std::size_t r = 0; r < split.test.size(); ++r) {
    const bool unseen = o.group[static_cast<std::size_t>(split.test[r])] == 1;
    for (Index c = 0; c < GetParam(); ++c) {
      EXPECT_EQ(std::isnan(errors.error(static_cast<Index>(r), c)), unseen);
      scored += unseen ? 0 : 1;
    }
  }
  EXPECT_EQ(errors.count(), scored);
  EXPECT_LT(scored, errors.error.size());
  EXPECT_TRUE(std::isfinite(errors.sum_of_squares()));
  EXPECT_TRUE(std::isfinite(errors.loss()));

  std::vector<int> seen = split.test;
  std::erase_if(seen, [&](int row) { return o.group[static_cast<std::size_t>(row)] == 1; });
  const HeldOutErrors same = predict_held_out(o, {o.y}, {}, known_variances(o, 0.002, 2), split.fit, seen);
  EXPECT_NEAR(same.loss(), errors.loss(), 1e-9 * same.loss());
}

TEST_P(HeldOut, WhereTheGroupIsTheBlockItsConstantComesFromEveryOtherRun) {
  std::mt19937_64 random(test::seed() + 4);
  Observations o = test::simulate({.runs_of_block = std::vector<int>(6, 5),
                                   .groups = 6,
                                   .channels = GetParam(),
                                   .session_ratio = 0,
                                   .multiplicative = false},
                                  random);
  o.group = o.block;
  o.groups_within_blocks = true;
  const Split split = split_blocks(o);
  const HeldOutErrors errors =
      predict_held_out(o, {o.y}, {}, known_variances(o, 0.002, 0), split.fit, split.test);
  for (std::size_t r = 0; r < split.test.size(); ++r) {
    const auto place = r % 5;  // in its block: 0, 2 and 4 give the constant, 1 and 3 are scored
    for (Index c = 0; c < GetParam(); ++c) {
      const double error = errors.error(static_cast<Index>(r), c);
      if (place % 2 == 0) {
        EXPECT_TRUE(std::isnan(error));
        continue;
      }
      const int first = split.test[r - place];
      const double constant = (o.value(first, c) + o.value(first + 2, c) + o.value(first + 4, c)) / 3;
      EXPECT_NEAR(error, constant - o.value(split.test[r], c), 1e-12);
      EXPECT_NEAR(errors.expected_std(static_cast<Index>(r), c), 0.002 * std::sqrt(1 + 1 / 3.0), 1e-12);
    }
  }
}

/// What only held-out runs tell has no error there, or what they told the linearisation would be its own
/// proof: a column of one block, and one that the others' baseline has in it.
TEST_P(HeldOut, RunsOfAnAmplitudeThatTheFitLeavesUndeterminedAreNotScored) {
  std::mt19937_64 random(test::seed() + 8);
  const Observations o = test::simulate({.channels = GetParam()}, random);
  const Split split = split_blocks(o);
  const NullFit null = known_variances(o, 0.002, 2);
  const auto in_block = [&](int row) { return o.block[static_cast<std::size_t>(row)] == 4; };
  const auto in_group = [&](int row) { return o.group[static_cast<std::size_t>(row)] == 1; };
  MatrixXd of_one_block = MatrixXd::Zero(o.rows(), GetParam()), of_one_group = of_one_block;
  for (const int row : o.all_rows())
    if (in_block(row)) of_one_block.row(row).setConstant(0.3 + 0.1 * row);
  for (const int row : split.fit)
    if (in_group(row)) of_one_group.row(row).setConstant(2);
  for (const int row : split.test)
    if (in_group(row)) of_one_group.row(row).setConstant(5 + row);
  const MatrixXd shared = normal(o.rows(), GetParam(), random);
  const auto predicted = [&](const std::vector<Components>& columns) {
    return predict_held_out(o, {o.y}, columns, null, split.fit, split.test);
  };
  const HeldOutErrors without = predicted({{shared}}), block = predicted({{shared}, {of_one_block}}),
                      group = predicted({{shared}, {of_one_group}}),
                      both = predicted({{of_one_block}, {shared}, {of_one_group}});
  for (std::size_t r = 0; r < split.test.size(); ++r) {
    const int row = split.test[r];
    const auto place = static_cast<Index>(r);
    EXPECT_EQ(std::isnan(block.error(place, 0)), in_block(row));
    EXPECT_EQ(std::isnan(group.error(place, 0)), in_group(row));
    EXPECT_EQ(std::isnan(both.error(place, 0)), in_block(row) || in_group(row));
    const auto is_as_without = [&](double error) { return std::abs(error - without.error(place, 0)) < 1e-9; };
    EXPECT_TRUE(in_block(row) || is_as_without(block.error(place, 0)));
    EXPECT_TRUE(in_group(row) || is_as_without(group.error(place, 0)));
  }
  EXPECT_LT(block.count(), without.count());
  EXPECT_LT(group.count(), without.count());

  // A shift of one block, taken out of y as the fit has it: that block does not speak for it.
  const Components all_of_it = {of_one_block};
  const CrossValidation before = cross_validate(o, {o.y + 3 * of_one_block}, {}, null, o.all_rows()),
                        after = cross_validate(o, {o.y}, {all_of_it}, null, o.all_rows());
  const VectorXd lower = before.losses() - after.losses();
  EXPECT_NEAR(compare(before, after).total, lower.sum() - lower(4), 1e-9 * lower.sum());
  EXPECT_GT(lower(4), 0.1 * lower.sum());
}

INSTANTIATE_TEST_SUITE_P(Rotors, HeldOut, testing::Values(1, 4));

TEST(CrossValidation, LeavesOutEachBlockOnce) {
  std::mt19937_64 random(test::seed() + 5);
  const Observations o = test::simulate({.runs_of_block = {4, 6, 5, 3, 7, 5, 4, 6}}, random);
  const NullFit null = known_variances(o, 0.002, 3);
  const CrossValidation validation = cross_validate(o, {o.y}, {}, null, o.all_rows());
  ASSERT_EQ(validation.folds.size(), 8u);
  double squares = 0;
  for (int block = 0; block < 8; ++block) {
    std::vector<int> fit, held;
    for (const int row : o.all_rows())
      (o.block[static_cast<std::size_t>(row)] == block ? held : fit).push_back(row);
    const HeldOutErrors direct = predict_held_out(o, {o.y}, {}, null, fit, held);
    EXPECT_EQ(validation.folds[static_cast<std::size_t>(block)].rows, held);
    EXPECT_NEAR(validation.losses()(block), direct.loss(), 1e-9);
    squares += direct.sum_of_squares();
  }
  EXPECT_EQ(validation.all().count(), o.rows());
  EXPECT_NEAR(validation.all().sum_of_squares(), squares, 1e-12 * squares);
  const LossDifference none = compare(validation, validation);
  EXPECT_EQ(none.mean, 0);
  EXPECT_EQ(none.standard_error, 0);
  EXPECT_EQ(none.total, 0);
  EXPECT_FALSE(none.told_apart());
}

TEST(CrossValidation, ModelsAreToldApartByMuchAndSurely) {
  const auto difference = [](double mean, double standard_error, double expected, double total) {
    return LossDifference{mean, standard_error, expected, total};
  };
  EXPECT_TRUE(difference(1, 0.4, 0.6, 12).told_apart());
  EXPECT_FALSE(difference(1, 0.6, 0.6, 12).told_apart()) << "within two standard errors";
  EXPECT_FALSE(difference(0.1, 0.01, 0.01, 1.2).told_apart()) << "likelihoods of 1.8 to 1, however surely";
  EXPECT_FALSE(difference(-1, 0.4, 0.6, -12).told_apart()) << "the better one";
}

TEST(CrossValidation, ManyBlocksAreDealtOut) {
  std::mt19937_64 random(test::seed() + 6);
  const Observations o = test::simulate({.runs_of_block = std::vector<int>(60, 2)}, random);
  const CrossValidation validation = cross_validate(o, {o.y}, {}, known_variances(o, 0.002, 1), o.all_rows());
  EXPECT_EQ(validation.folds.size(), 24u);
  std::size_t rows = 0;
  for (const HeldOutErrors& fold : validation.folds) rows += fold.rows.size();
  EXPECT_EQ(rows, 120u);
}

}  // namespace
}  // namespace tunnelrig
