#include "calibration/crosstalk.h"

#include "calibration/known_truth.h"
#include "support/temporary_folder.h"

#include <cmath>
#include <iostream>
#include <random>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

using test::both_ways;
using test::message_of;
using test::SyntheticTable;
using test::three_axes;
using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr double kGramForce_N = 9.80665e-3;

TEST(Crosstalk, AKnownMatrixComesBackAndSoDoTheForces) {
  for (const SyntheticTable& truth : {three_axes(), both_ways()}) {
    std::mt19937 engine(1);
    const CrosstalkFit fit = fit_crosstalk(truth.take(engine));
    EXPECT_TRUE(fit.convergence.converged) << fit.convergence.message;
    EXPECT_TRUE(fit.matrix.isApprox(truth.matrix, 1e-9)) << fit.matrix;
    EXPECT_TRUE((fit.even - truth.even).isZero(1e-9)) << fit.even;
    EXPECT_THAT(fit.suspicious, IsEmpty());
    for (Eigen::Index block = 0; block < 3; ++block) {
      EXPECT_TRUE(fit.zeros.row(block).transpose().isApprox(truth.zero_of(block), 1e-9));
    }
    std::uniform_real_distribution<double> load(-10, 10);
    for (int i = 0; i < 100; ++i) {  // forward, then back
      const Eigen::Vector3d force(load(engine), load(engine), load(engine));
      const Eigen::VectorXd reading = truth.matrix * force + truth.even * force.cwiseAbs();
      const auto back = fit.forces(reading, Eigen::Vector3d::Zero());
      EXPECT_TRUE(back.force_N.isApprox(force, 1e-8)) << force.transpose();
    }
  }
}

TEST(Crosstalk, TheCoefficientsU95HoldsTheTruth) {
  SyntheticTable truth = three_axes();
  truth.noise = 0.01;
  double held = 0, all = 0;
  for (unsigned seed = 0; seed < 40; ++seed) {
    std::mt19937 engine(seed);
    const CrosstalkFit fit = fit_crosstalk(truth.take(engine));
    const Eigen::ArrayXXd off = (fit.matrix - truth.matrix).array().abs();
    held += static_cast<double>((off <= fit.matrix_u95().array()).count());
    all += static_cast<double>(off.size());
    EXPECT_THAT(format_crosstalk(fit), HasSubstr("Its U95"));
  }
  EXPECT_GT(held / all, 0.9);
  EXPECT_LT(held / all, 0.99);
}

TEST(Crosstalk, OneCommonZeroAndNoSignTermsAreChoices) {
  std::mt19937 engine(2);
  CrosstalkTable table = both_ways().take(engine);
  EXPECT_TRUE(fit_crosstalk(table, {.sign_terms = false}).even.isZero(0));
  for (Eigen::Index row = 0; row < table.reading.rows(); ++row) {
    const int block = table.block[static_cast<std::size_t>(row)];
    table.reading.row(row) -= both_ways().zero_of(block).transpose();
    table.reading.row(row).array() += 4;
  }
  const CrosstalkFit fit = fit_crosstalk(table, {.zeros = BlockZero::kCommon});
  ASSERT_EQ(fit.zeros.rows(), 1);
  EXPECT_TRUE(fit.zeros.isApproxToConstant(4, 1e-9));
  EXPECT_TRUE(fit.matrix.isApprox(both_ways().matrix, 1e-9));
}

TEST(Crosstalk, AGrossRowIsNamedLeftOutAndKeptOnRequest) {
  const SyntheticTable truth{three_axes().matrix, three_axes().even, three_axes().loads, 0.002};
  for (const Eigen::Index bad : {0, 2, 7, 14}) {  // a zero row, in the middle, and at the end of the lever
    std::mt19937 engine(3);
    CrosstalkTable table = truth.take(engine);
    table.reading(bad, 1) += 0.6;
    const CrosstalkFit fit = fit_crosstalk(table);
    ASSERT_FALSE(fit.suspicious.empty());
    EXPECT_EQ(fit.suspicious[0].line, bad + 2);
    EXPECT_EQ(fit.suspicious[0].channel, "reading_1");
    EXPECT_TRUE(fit.suspicious[0].left_out);
    EXPECT_NEAR(fit.suspicious[0].residual_N, 0.6 / -3, 0.01);
    EXPECT_EQ(fit.rows_used, 14);
    EXPECT_TRUE(fit.matrix.isApprox(truth.matrix, 2e-3));
    const CrosstalkFit kept = fit_crosstalk(table, {.leave_out_gross = false});
    EXPECT_EQ(kept.rows_used, 15);
    EXPECT_TRUE(kept.suspicious[0].gross);
    EXPECT_FALSE(kept.suspicious[0].left_out);
  }
}

TEST(Crosstalk, RefusesWhatDoesNotDetermineTheMatrix) {
  const auto refusal = [](const CrosstalkTable& table, const CrosstalkOptions& options = {}) {
    return message_of([&] { fit_crosstalk(table, options); });
  };
  std::mt19937 engine(4);
  SyntheticTable truth = three_axes();
  truth.loads[1].clear();
  EXPECT_THAT(refusal(truth.take(engine)), HasSubstr("table.csv: force_1 is never loaded"));
  truth.loads = {{2}, {3}, {4}};
  EXPECT_THAT(refusal(truth.take(engine)), HasSubstr("6 rows for 6 coefficients"));
  CrosstalkTable together = three_axes().take(engine);
  together.force_N.col(1) = together.force_N.col(0);
  EXPECT_THAT(refusal(together), HasSubstr("only together with another"));
  truth = three_axes();
  truth.matrix.row(1) = 2 * truth.matrix.row(0);
  EXPECT_THAT(refusal(truth.take(engine)), HasSubstr("do not tell the forces"));
  CrosstalkTable broken = three_axes().take(engine);
  broken.reading(3, 1) = std::nan("");
  EXPECT_THAT(refusal(broken), HasSubstr("not finite"));
  const Sheet header = parse_csv("fx,fy,sx,sy\n", "header.csv");
  EXPECT_THAT(refusal(read_crosstalk(header, {{"fx", "fy"}, {"sx", "sy"}, "N"})),
              HasSubstr("header.csv: there is no row of forces and readings"));
}

const CrosstalkSpec kSpec{{"fx", "fy"}, {"sx", "sy"}, "gf"};

TEST(Crosstalk, ReadsForcesReadingsAndBlocks) {
  const Sheet sheet =
      parse_csv("fy,fx,,sx,sy\n0,0,a,1,2\n0,0,,3,4\n0,100,,5,6\n0,0,,7,8\n50,0,,9,10\n", "cell.csv");
  const CrosstalkTable table = read_crosstalk(sheet, kSpec);
  EXPECT_EQ(table.block, (std::vector<int>{0, 0, 0, 1, 1}));  // zero rows in succession are of one block
  EXPECT_EQ(table.line, (std::vector<int>{2, 3, 4, 5, 6}));
  EXPECT_NEAR(table.force_N(2, 0), 100 * kGramForce_N, 1e-15);
  EXPECT_NEAR(table.force_N(4, 1), 50 * kGramForce_N, 1e-15);
  EXPECT_EQ(table.reading(4, 1), 10);
}

TEST(Crosstalk, ReadingNamesFileLineAndColumn) {
  const Sheet sheet = parse_csv("fx,fy,sx,sy\n0,0,1,2\n0,,3,4\n", "cell.csv");
  const auto refusal = [&](const CrosstalkSpec& spec) {
    return message_of([&] { read_crosstalk(sheet, spec); });
  };
  EXPECT_THAT(refusal(kSpec), HasSubstr("cell.csv:3: column fy: a number is required"));
  EXPECT_THAT(refusal({{"fx", "fz"}, {"sx", "sy"}, "N"}), HasSubstr("the required column fz is missing"));
  EXPECT_THAT(refusal({{"fx", "fy"}, {"sx", "sy"}, "rpm"}),
              HasSubstr("'rpm' is a unit of speed, not of force"));
  EXPECT_THAT(refusal({{"fx", "fy"}, {"sx"}, "N"}), HasSubstr("as many of each"));
  const auto of = [](const char* text) {
    return message_of([&] { read_crosstalk(parse_csv(text, "cell.csv"), kSpec); });
  };
  EXPECT_THAT(of("fx,fz,sx,sy\n"), HasSubstr("cell.csv:1: the required column fy is missing"));
  EXPECT_THAT(of("fx,fy,sx,sy\n0,1e155,1,2\n"), HasSubstr("cell.csv:2: column fy: 1e+155 is beyond"));
  EXPECT_THAT(of("fx,fy,sx,sy\n0,1,1,2\n0,1,-1e300,2\n"), HasSubstr("cell.csv:3: column sx: -1e+300"));
}

// --- FARE-KE (telenaco/FARE-KE): three three-axis cells, measured

CrosstalkTable fareke_cell(int cell) {
  const auto path = test::shared_data() / fmt::format("fareke_load_cells/cell{}.csv", cell);
  return read_crosstalk(read_csv(path),
                        {{"force_x", "force_y", "force_z"}, {"sensor_x", "sensor_y", "sensor_z"}, "gf"});
}

CrosstalkTable rows_of(const CrosstalkTable& table, const std::vector<Eigen::Index>& rows) {
  CrosstalkTable part{.file = table.file,
                      .axes = table.axes,
                      .channels = table.channels,
                      .force_N = table.force_N(rows, Eigen::all),
                      .reading = table.reading(rows, Eigen::all)};
  for (const Eigen::Index row : rows) {
    part.block.push_back(table.block[static_cast<std::size_t>(row)]);
    part.line.push_back(table.line[static_cast<std::size_t>(row)]);
  }
  return part;
}

/// Fitted without the top load of each block; root mean square over these three rows and the three axes, of
/// the force from the reading and the block's measured zero row, minus the applied force; in gf.
double held_out_error_gf(const CrosstalkTable& table, const CrosstalkOptions& options) {
  std::vector<Eigen::Index> kept, held, zero_row(3, -1);
  const Eigen::VectorXd load = table.force_N.rowwise().norm();
  for (Eigen::Index i = 0; i < load.size(); ++i) {
    const auto block = static_cast<std::size_t>(table.block[static_cast<std::size_t>(i)]);
    if (load[i] == 0) zero_row[block] = i;
    (load[i] == load.maxCoeff() ? held : kept).push_back(i);
  }
  EXPECT_EQ(held.size(), 3u);
  const CrosstalkFit fit = fit_crosstalk(rows_of(table, kept), options);
  double squares = 0;
  for (const Eigen::Index i : held) {
    const Eigen::Index zero = zero_row[static_cast<std::size_t>(table.block[static_cast<std::size_t>(i)])];
    const auto found = fit.forces(table.reading.row(i).transpose(), table.reading.row(zero).transpose());
    squares += (found.force_N - table.force_N.row(i).transpose()).squaredNorm();
  }
  return std::sqrt(squares / 9) / kGramForce_N;
}

TEST(Crosstalk, TheMatrixExplainsFarekesTopLoadsAndOneGainPerAxisDoesNot) {
  SKIP_WITHOUT_SHARED_DATA();
  struct Expected {
    int cell;
    double diagonal_gf, matrix_gf;
  };
  for (const Expected& expected : {Expected{1, 13.1, 1.7}, Expected{3, 13.1, 2.8}, Expected{4, 9.6, 1.3}}) {
    const CrosstalkTable table = fareke_cell(expected.cell);
    const double diagonal = held_out_error_gf(table, {.shape = MatrixShape::kDiagonal});
    const double matrix = held_out_error_gf(table, {});
    std::cout << fmt::format("cell {}: diagonal {:.2f} gf, matrix {:.2f} gf\n", expected.cell, diagonal,
                             matrix);
    EXPECT_NEAR(diagonal, expected.diagonal_gf, 0.5);
    EXPECT_LE(matrix, expected.matrix_gf);
  }
}

TEST(Crosstalk, FarekesGrossRowIsNamed) {
  SKIP_WITHOUT_SHARED_DATA();
  const double kept = held_out_error_gf(fareke_cell(3), {.leave_out_gross = false});
  std::cout << fmt::format("cell 3, gross row kept: matrix {:.2f} gf\n", kept);
  EXPECT_GT(kept, 3 * held_out_error_gf(fareke_cell(3), {}));
  const CrosstalkFit fit = fit_crosstalk(fareke_cell(3));
  ASSERT_FALSE(fit.suspicious.empty());
  EXPECT_EQ(fit.suspicious[0].line, 8);  // Y = 151 gf
  EXPECT_EQ(fit.suspicious[0].channel, "sensor_y");
  EXPECT_TRUE(fit.suspicious[0].left_out);
  EXPECT_NEAR(fit.suspicious[0].residual_N / kGramForce_N, -29, 1);
  EXPECT_EQ(fit.rows_used, 14);
  for (const int cell : {1, 4}) EXPECT_EQ(fit_crosstalk(fareke_cell(cell)).rows_used, 15) << cell;
}

}  // namespace
}  // namespace tunnelrig
