// Several axes or cells at once: the matrix from forces to readings, and back (docs/calibration.md).
#pragma once

#include "calibration/load_cell.h"
#include "datasets/csv.h"

#include <string>
#include <vector>

#include <Eigen/Core>

namespace tunnelrig {

/// Which columns of a CSV are the forces and readings of n axes, in the same order.
struct CrosstalkSpec {
  std::vector<std::string> force_columns;
  std::vector<std::string> reading_columns;  // any unit: volts, counts
  std::string force_unit = "N";              // a force of datasets/units.h, such as "gf"
};

/// Rows of forces on n axes and the readings of n channels. A row whose forces are all zero starts a new
/// block, unless the row before it is one too.
struct CrosstalkTable {
  std::string file;
  std::vector<std::string> axes, channels;  // the columns' names
  Eigen::MatrixXd force_N;                  // rows × n
  Eigen::MatrixXd reading;                  // rows × n
  std::vector<int> block;                   // of each row, from 0
  std::vector<int> line;                    // of the file

  Eigen::Index size() const { return force_N.cols(); }
  int blocks() const { return block.empty() ? 0 : block.back() + 1; }
};

/// Throws InputError naming file, line and column for a missing column, a cell that is no number, or a unit
/// that is not one of force.
CrosstalkTable read_crosstalk(const Sheet& sheet, const CrosstalkSpec& spec);

enum class BlockZero {
  kPerBlock,  // each block has a zero of its own; its zero rows are observations of it like any other row
  kCommon,    // one zero for all rows
};

enum class MatrixShape { kFull, kDiagonal };

struct CrosstalkOptions {
  BlockZero zeros = BlockZero::kPerBlock;
  MatrixShape shape = MatrixShape::kFull;
  bool sign_terms = true;      // a gain for each sign of load on every axis that was loaded both ways
  double suspicious_p = 0.01;  // rows with a smaller Bonferroni p are named
  GrossRule gross;             // its p over all rows and channels
  bool leave_out_gross = true;
};

/// A row of the table that does not fit the others.
struct CrosstalkRow {
  int line = 0;
  std::string channel;    // where it stands out most
  double residual_N = 0;  // in that channel, over its largest gain
  double studentised = 0;
  double p = 1;  // Bonferroni
  bool gross = false;
  bool left_out = false;
};

/// reading = zero(block) + matrix · force + even · |force|. Column j of `even` is zero where axis j was
/// loaded one way only: with both signs, matrix ± even are the gains for positive and negative load.
struct CrosstalkFit {
  std::vector<std::string> axes, channels;
  Eigen::MatrixXd matrix;               // n × n, reading per N: row = channel, column = axis
  Eigen::MatrixXd even;                 // n × n, reading per N
  Eigen::MatrixXd zeros;                // blocks × n (one row where common), reading
  Eigen::MatrixXd covariance;           // 2n² × 2n², of the rows of [matrix even] one after the other
  Eigen::MatrixXd residual_covariance;  // n × n, of one row's readings
  int rows_used = 0;
  int dof = 0;  // of the channel with the fewest
  FitConvergence convergence;
  std::vector<CrosstalkRow> suspicious;  // by p

  struct Forces {
    Eigen::VectorXd force_N;      // n
    Eigen::MatrixXd per_reading;  // n × n, ∂force/∂reading
    Eigen::MatrixXd covariance;   // n × n, N², from that of the coefficients
  };

  /// Half widths of the coefficients' 95 % intervals, n × n, of `matrix` and of `even`.
  Eigen::MatrixXd matrix_u95() const;
  Eigen::MatrixXd even_u95() const;

  /// Forces from readings and the zeros of the same channels, both of n.
  Forces forces(const Eigen::VectorXd& reading, const Eigen::VectorXd& zero) const;
};

/// Least squares in Ceres, channel by channel. Gross rows are named, and left out unless the options say
/// else. Throws InputError for too few rows, an axis that was never loaded or only together with another, and
/// channels that do not tell the axes apart.
CrosstalkFit fit_crosstalk(const CrosstalkTable& table, const CrosstalkOptions& options = {});

/// The matrix as a table of text, with the rows that do not fit; JSON of everything; `indent` as nlohmann's
/// dump.
std::string format_crosstalk(const CrosstalkFit& fit);
std::string to_json(const CrosstalkFit& fit, int indent = -1);

}  // namespace tunnelrig
