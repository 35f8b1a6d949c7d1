#include "calibration/crosstalk.h"
#include "calibration/distributions.h"
#include "calibration/json_eigen.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace tunnelrig {
namespace {

/// A matrix with its channels in front and its axes on top.
std::string table(const CrosstalkFit& fit, const Eigen::MatrixXd& matrix) {
  std::string text = fmt::format("  {:>16}", "");
  for (const std::string& axis : fit.axes) text += fmt::format(" {:>16}", axis);
  for (Eigen::Index channel = 0; channel < matrix.rows(); ++channel) {
    text += fmt::format("\n  {:>16}", fit.channels[static_cast<std::size_t>(channel)]);
    for (Eigen::Index axis = 0; axis < matrix.cols(); ++axis)
      text += fmt::format(" {:>16.6g}", matrix(channel, axis));
  }
  return text + '\n';
}

/// Of the n columns of [matrix even] from `first` on.
Eigen::MatrixXd u95_of(const CrosstalkFit& fit, Eigen::Index first) {
  const Eigen::Index n = fit.matrix.rows();
  Eigen::MatrixXd u95(n, n);
  for (Eigen::Index channel = 0; channel < n; ++channel)
    for (Eigen::Index axis = 0; axis < n; ++axis) {
      const Eigen::Index at = 2 * n * channel + first + axis;
      u95(channel, axis) = half_width_95(std::sqrt(std::max(0.0, fit.covariance(at, at))), fit.dof);
    }
  return u95;
}

}  // namespace

Eigen::MatrixXd CrosstalkFit::matrix_u95() const { return u95_of(*this, 0); }
Eigen::MatrixXd CrosstalkFit::even_u95() const { return u95_of(*this, matrix.rows()); }

std::string format_crosstalk(const CrosstalkFit& fit) {
  std::string text = fmt::format("Crosstalk matrix, reading per N ({} rows, {} degrees of freedom)\n",
                                 fit.rows_used, fit.dof) +
                     table(fit, fit.matrix) + "Its U95\n" + table(fit, fit.matrix_u95());
  if (!fit.even.isZero(0)) {
    text += "Even part: matrix + even holds for positive load, matrix - even for negative\n" +
            table(fit, fit.even) + "Its U95\n" + table(fit, fit.even_u95());
  }
  for (const CrosstalkRow& row : fit.suspicious) {
    text +=
        fmt::format("  line {}: {} is {:+.3g} N off (studentised {:.1f}, p = {:.1g}){}\n", row.line,
                    row.channel, row.residual_N, row.studentised, row.p, row.left_out ? "; left out" : "");
  }
  return text;
}

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(CrosstalkRow, line, channel, residual_N, studentised, p, gross, left_out)

std::string to_json(const CrosstalkFit& fit, int indent) {
  return nlohmann::json{{"format", "tunnelrig-crosstalk/1"},
                        {"axes", fit.axes},
                        {"channels", fit.channels},
                        {"matrix_per_N", fit.matrix},
                        {"matrix_u95_per_N", fit.matrix_u95()},
                        {"even_per_N", fit.even},
                        {"even_u95_per_N", fit.even_u95()},
                        {"zeros", fit.zeros},
                        {"residual_covariance", fit.residual_covariance},
                        {"rows_used", fit.rows_used},
                        {"dof", fit.dof},
                        {"suspicious", fit.suspicious}}
      .dump(indent);
}

}  // namespace tunnelrig
