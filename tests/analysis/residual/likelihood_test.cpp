// Likelihood ratios against brute force on dense matrices.
#include "analysis/residual/likelihood/likelihood.h"

#include "analysis/residual/likelihood/strata_fit.h"
#include "analysis/residual/simulated.h"
#include "calibration/distributions.h"
#include "support/seeds.h"

#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Restricted log-likelihood of y at a ratio, the columns' amplitudes and σ at their best.
struct DenseFit {
  double log_likelihood = 0, sigma = 0;
  VectorXd amplitude;
};
DenseFit dense_fit(const Observations& o, const VectorXd& y, const MatrixXd& columns, double ratio) {
  const std::vector<int> rows = o.all_rows();
  const MatrixXd v = test::dense_covariance(o, rows, ratio), x = test::dense_baseline(o, rows, rows);
  MatrixXd all(x.rows(), x.cols() + columns.cols());
  all << x, columns;
  const MatrixXd vinv = v.inverse();
  const VectorXd beta = (all.transpose() * vinv * all).ldlt().solve(all.transpose() * vinv * y);
  const VectorXd residual = y - all * beta;
  const double rss = residual.dot(vinv * residual), dof = static_cast<double>(y.size() - x.cols());
  const double determinants = std::log(v.determinant()) + std::log((x.transpose() * vinv * x).determinant());
  return {-0.5 * dof * std::log(rss / dof) - 0.5 * determinants, std::sqrt(rss / dof),
          beta.tail(columns.cols())};
}

/// The best of the grid's ratios from `first` to `last`.
DenseFit best_of(const Observations& o, const VectorXd& y, const MatrixXd& columns, std::size_t first,
                 std::size_t last, std::size_t* at = nullptr) {
  DenseFit best{.log_likelihood = -1e300, .amplitude = {}};
  for (std::size_t r = first; r <= last; ++r) {
    DenseFit fit = dense_fit(o, y, columns, kRatios[r]);
    if (fit.log_likelihood <= best.log_likelihood) continue;
    best = std::move(fit);
    if (at != nullptr) *at = r;
  }
  return best;
}

MatrixXd normal_matrix(Index rows, Index columns, std::mt19937_64& random) {
  std::normal_distribution<double> draw;
  return MatrixXd::NullaryExpr(rows, columns, [&] { return draw(random); });
}

TEST(Likelihood, NullIsTheDenseMaximum) {
  std::mt19937_64 random(test::seed());
  for (int i = 0; i < 30; ++i) {
    const Observations o =
        test::simulate({.runs_of_block = {3, 6, 4, 8, 5, 2, 7}, .session_ratio = 0.3 * i}, random);
    const MixedModel model(o, o.all_rows());
    const NullFit null = CandidateScan(model, {}, {}).null_fit({o.y});
    std::size_t ratio = 0;
    const DenseFit dense = best_of(o, o.y.col(0), MatrixXd(o.rows(), 0), 0, kRatios.size() - 1, &ratio);
    EXPECT_EQ(null.ratio[0], ratio);
    EXPECT_NEAR(null.log_likelihood, dense.log_likelihood, 1e-8);
    EXPECT_NEAR(null.sigma[0], dense.sigma, 1e-10);
    double sum = 0;
    for (std::size_t r = 0; r < kRatios.size(); ++r) {
      sum += null.ratio_probability[0][r];
      const double log_likelihood =
          dense_fit(o, o.y.col(0), MatrixXd(o.rows(), 0), kRatios[r]).log_likelihood;
      EXPECT_NEAR(std::log(null.ratio_probability[0][r] / null.ratio_probability[0][ratio]),
                  log_likelihood - dense.log_likelihood, 1e-7);
    }
    EXPECT_NEAR(sum, 1, 1e-12);
  }
}

TEST(Likelihood, RatioOfACandidateIsTheDenseOne) {
  std::mt19937_64 random(test::seed() + 1);
  for (int i = 0; i < 60; ++i) {
    Observations o =
        test::simulate({.runs_of_block = {3, 6, 4, 8, 5, 2, 7, 5}, .session_ratio = 0.2 * (i % 12)}, random);
    MatrixXd column = normal_matrix(o.rows(), 1, random);
    if (i % 2 == 0)  // constant within sessions
      for (Index row = 0; row < o.rows(); ++row)
        column(row) = std::cos(1.0 + o.block[static_cast<std::size_t>(row)]);
    test::set_y(o, o.y + 0.0007 * (i % 5) * column);
    const MixedModel model(o, o.all_rows());
    const CandidateScan scan(model, {}, {{.columns = {{column}}}});
    const NullFit null = scan.null_fit({o.y});
    const CandidateFit fit = scan.fit({o.y})[0];
    // Session variances above the null's are not tried.
    const std::size_t start = null.ratio[0], lowest = start > 4 ? start - 4 : 0;
    const DenseFit dense = best_of(o, o.y.col(0), column, lowest, start);
    EXPECT_NEAR(fit.likelihood_ratio, std::max(0.0, dense.log_likelihood - null.log_likelihood), 1e-7);
    EXPECT_NEAR(fit.amplitude(0), dense.amplitude(0), 1e-9);
    const DenseFit anywhere = best_of(o, o.y.col(0), column, 0, kRatios.size() - 1);
    EXPECT_LE(fit.likelihood_ratio, anywhere.log_likelihood - null.log_likelihood + 1e-7);
  }
}

/// Adopted columns are the model's, whatever sessions scatter like; also where one is a sum of others.
TEST(Likelihood, AdoptedColumnsStayIn) {
  std::mt19937_64 random(test::seed() + 2);
  for (int i = 0; i < 30; ++i) {
    Observations o =
        test::simulate({.runs_of_block = {3, 6, 4, 8, 5, 2, 7, 5}, .session_ratio = 0.2 * (i % 12)}, random);
    const MatrixXd columns = normal_matrix(o.rows(), 4, random);
    test::set_y(o, o.y + columns * VectorXd::Constant(4, 0.0007 * (i % 5)));
    std::vector<Components> adopted = {{columns.col(0)}, {columns.col(1)}};
    if (i % 2 == 1) adopted.push_back({columns.col(0) - 2 * columns.col(1)});
    const MixedModel model(o, o.all_rows());
    const CandidateScan scan(
        model, adopted, {{.columns = {{columns.col(2)}}}, {.columns = {{columns.col(2)}, {columns.col(3)}}}});
    const NullFit null = scan.null_fit({o.y});
    const DenseFit without = best_of(o, o.y.col(0), columns.leftCols(2), 0, kRatios.size() - 1);
    EXPECT_NEAR(null.log_likelihood, without.log_likelihood, 1e-7);
    const double spent = static_cast<double>(model.dof(0)) / static_cast<double>(model.dof(0) - 2);
    EXPECT_NEAR(null.sigma[0], without.sigma * std::sqrt(spent), 1e-9);
    const std::size_t start = null.ratio[0], lowest = start > 4 ? start - 4 : 0;
    const auto fits = scan.fit({o.y});
    for (Index k = 1; k <= 2; ++k) {
      const DenseFit with = best_of(o, o.y.col(0), columns.leftCols(2 + k), lowest, start);
      const CandidateFit& fit = fits[static_cast<std::size_t>(k - 1)];
      EXPECT_NEAR(fit.likelihood_ratio, std::max(0.0, with.log_likelihood - null.log_likelihood), 1e-6);
      EXPECT_LT((fit.amplitude - with.amplitude.tail(k)).norm(), 1e-8);
    }
  }
}

TEST(Likelihood, EvidenceIsTheTailOfFisher) {
  std::mt19937_64 random(test::seed() + 3);
  Observations o = test::simulate({.session_ratio = 0}, random);
  o.blocks_are_rows = true;  // no session variance: ordinary least squares
  const MatrixXd column = normal_matrix(o.rows(), 1, random);
  test::set_y(o, o.y + 0.0004 * column);
  const MixedModel model(o, o.all_rows());
  const CandidateFit fit = CandidateScan(model, {}, {{.columns = {{column}}}}).fit({o.y})[0];
  const VectorXd y = o.y.col(0);
  const MatrixXd x = test::dense_baseline(o, o.all_rows(), o.all_rows());
  MatrixXd all(x.rows(), x.cols() + 1);
  all << x, column;
  const auto rss = [&](const MatrixXd& m) {
    return (y - m * m.colPivHouseholderQr().solve(y)).squaredNorm();
  };
  const double dof = static_cast<double>(model.dof(0));
  const double f = (rss(x) - rss(all)) / rss(all) * (dof - 1);
  EXPECT_NEAR(fit.evidence, -std::log10(f_upper_p(f, 1, dof - 1)), 0.01);
  const auto weighted = CandidateScan(model, {}, {{.columns = {{column}}, .weight = 10}}).fit({o.y});
  EXPECT_NEAR(weighted[0].evidence, fit.evidence + 1, 1e-9);
}

TEST(Likelihood, TheWrongSignIsNoEvidence) {
  std::mt19937_64 random(test::seed() + 4);
  Observations o = test::simulate({}, random);
  const MatrixXd column = normal_matrix(o.rows(), 1, random);
  test::set_y(o, o.y - 0.01 * column);
  const MixedModel model(o, o.all_rows());
  const auto fits =
      CandidateScan(
          model, {},
          {{.columns = {{column}}, .sign = 1}, {.columns = {{column}}, .sign = -1}, {.columns = {{column}}}})
          .fit({o.y});
  EXPECT_EQ(fits[0].evidence, 0);
  EXPECT_GT(fits[1].evidence, 5);
  EXPECT_EQ(fits[1].evidence, fits[2].evidence);
}

TEST(Likelihood, FourRotorsFindWhatOneRotorHas) {
  std::mt19937_64 random(test::seed() + 5);
  Observations o = test::simulate({.channels = 4}, random);
  MatrixXd one = MatrixXd::Zero(o.rows(), 4);
  one.col(2) = normal_matrix(o.rows(), 1, random);
  const MatrixXd all = one.col(2).replicate(1, 4);
  test::set_y(o, o.y + 0.003 * one);
  const MixedModel model(o, o.all_rows());
  const auto fits = CandidateScan(model, {}, {{.columns = {{one}}}, {.columns = {{all}}}}).fit({o.y});
  EXPECT_GT(fits[0].evidence, fits[1].evidence + 3);
  EXPECT_NEAR(fits[0].amplitude(0), 0.003, 0.0015);
}

/// Four rotors, whose strata differ; two columns adopted, nine candidates of one column and one of three.
struct Screened : testing::Test {
  std::mt19937_64 random{test::seed() + 8};
  Observations o = test::simulate(
      {.runs_of_block = std::vector<int>(12, 8), .channels = 4, .sigma = 0.002, .session_ratio = 2}, random);
  MixedModel model{o, o.all_rows()};
  std::vector<Components> adopted = {{of_all()}, {of_one()}};
  std::vector<Candidate> candidates;

  MatrixXd of_all() { return normal_matrix(o.rows(), 1, random) * Eigen::RowVectorXd::Ones(4); }
  MatrixXd of_one() {
    MatrixXd column = MatrixXd::Zero(o.rows(), 4);
    column.col(2) = normal_matrix(o.rows(), 1, random);
    return column;
  }
  MatrixXd of_sessions() {
    MatrixXd column = of_all();
    for (Index row = 1; row < column.rows(); ++row)
      if (o.block[static_cast<std::size_t>(row)] == o.block[static_cast<std::size_t>(row - 1)])
        column.row(row) = column.row(row - 1);
    return column;
  }
  void SetUp() override {
    for (int i = 0; i < 3; ++i)
      for (const MatrixXd& column : {of_all(), of_one(), of_sessions()})
        candidates.push_back({.columns = {{column}}});
    candidates.push_back({.columns = {{of_all()}, {of_all()}, {of_sessions()}}, .weight = 0.5});
  }
};

TEST_F(Screened, AScoreIsTheRatioWhereVariancesAreHeld) {
  MatrixXd y = o.y;
  for (std::size_t i = 0; i < candidates.size(); i += 3) y += 0.0006 * candidates[i].columns[0][0];
  std::vector<Index> widths(candidates.size(), 1);
  widths.back() = 3;
  const ScanProducts products(model, adopted, candidates);
  const StrataFit fit(model, products, widths);
  std::vector<Stacked> data;
  const Components of_y = {y};
  for (std::size_t s = 0; s < model.strata().size(); ++s) data.push_back(model.stack(s, {&of_y}));
  const ScanProducts::Data times = products.times(data);
  const StrataFit::State null = fit.best_without(times, 0);
  const VectorXd scores = fit.scores(times, 0, null);
  double largest = 0;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    StrataFit::State with = null;
    fit.solve(times, 0, static_cast<int>(i), with);
    const double ratio = with.log_likelihood - null.log_likelihood, score = scores(static_cast<Index>(i));
    EXPECT_NEAR(ratio, score, 0.05 + 0.2 * score) << i;
    largest = std::max(largest, ratio);
  }
  EXPECT_GT(largest, 5);
}

/// The same data sets, each candidate alone: the largest of all is what is said of all together.
TEST_F(Screened, NoMaximumIsLost) {
  constexpr std::size_t kSets = 300;
  const NullFit null = CandidateScan(model, adopted, {}).null_fit({o.y});
  const auto maxima_of = [&](const std::vector<Candidate>& some) {
    std::mt19937_64 same(test::seed());
    return CandidateScan(model, adopted, some).simulated_maxima(null, kSets, same);
  };
  std::vector<double> expected(kSets, 0.0);
  for (const Candidate& each : candidates) {
    const std::vector<double> alone = maxima_of({each});
    for (std::size_t set = 0; set < kSets; ++set) expected[set] = std::max(expected[set], alone[set]);
  }
  const std::vector<double> all = maxima_of(candidates);
  int lost = 0;
  for (std::size_t set = 0; set < kSets; ++set) {
    EXPECT_LE(all[set], expected[set] + 1e-9);
    if (all[set] < expected[set] - 1e-9) ++lost;
  }
  EXPECT_LE(lost, 6);
}

TEST(NullFit, ScatterAllowsForWhatTheColumnsCost) {
  std::mt19937_64 random(test::seed());
  constexpr int kDraws = 400;
  constexpr double kSigma = 0.002;
  double sum = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    Observations o = test::simulate(
        {.runs_of_block = std::vector<int>(8, 1), .groups = 1, .sigma = kSigma, .session_ratio = 0}, random);
    o.blocks_are_rows = true;
    const MixedModel model(o, o.all_rows());
    std::vector<Components> columns;
    for (int k = 0; k < 3; ++k) columns.push_back({Eigen::MatrixXd::Random(o.rows(), o.channels())});
    const NullFit fit = CandidateScan(model, columns, {}).null_fit({o.y});
    sum += fit.sigma[0] * fit.sigma[0];
  }
  EXPECT_NEAR(sum / kDraws / (kSigma * kSigma), 1, 0.2) << "8 runs, a constant and three columns";
}

}  // namespace
}  // namespace tunnelrig
