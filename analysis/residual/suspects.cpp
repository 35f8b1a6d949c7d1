// Rows that do not belong to the others.
#include "analysis/residual/explanation_parts.h"
#include "calibration/distributions.h"

#include <algorithm>
#include <cmath>

namespace tunnelrig {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

double degrees_of_freedom(const Observations& observations, const JointFit& fit,
                          const std::vector<int>& rows) {
  const MixedModel mixed(observations, rows, fit.variances.ratio);
  Index dof = -static_cast<Index>(fit.linear.columns.size());
  for (std::size_t s = 0; s < mixed.strata().size(); ++s)
    if (mixed.strata()[s].means()) dof += mixed.dof(s);
  return static_cast<double>(std::max<Index>(dof, 2));
}

std::vector<SuspectRow> suspect_rows(const Observations& observations, const HeldOutErrors& errors,
                                     const NullFit& variances, double dof) {
  std::vector<SuspectRow> result;
  const double limit = student_t_quantile(
      1 - 0.005 / static_cast<double>(std::max<Index>(1, errors.error.size())), std::max(dof - 1, 1.0));
  double sigma2 = 0;
  const double channels = static_cast<double>(observations.channels());
  for (std::size_t s = 0; s < (channels > 1 ? 2U : 1U); ++s)
    sigma2 += std::pow(variances.sigma[s], 2) * (1 + kRatios[variances.ratio[s]]) *
              (s == 0 ? 1 : channels - 1) / channels;
  for (std::size_t r = 0; r < errors.rows.size(); ++r) {
    double worst = 0;
    for (Index c = 0; c < errors.error.cols(); ++c) {
      const double unit = observations.multiplicative ? std::abs(observations.value(errors.rows[r], c)) : 1;
      const double leverage = std::pow(errors.expected_std(static_cast<Index>(r), c) / unit, 2) / sigma2 - 1;
      const double inner =
          -errors.error(static_cast<Index>(r), c) / unit / std::sqrt(sigma2 * std::max(1 - leverage, 1e-3));
      const double room = std::max(dof - inner * inner, 1e-3);
      const double outer = inner * std::sqrt(std::max(dof - 1, 1.0) / room);
      if (std::abs(outer) > std::abs(worst)) worst = outer;
    }
    if (std::abs(worst) > limit)
      result.push_back({observations.name[static_cast<std::size_t>(errors.rows[r])], worst});
  }
  std::sort(result.begin(), result.end(), [](const SuspectRow& a, const SuspectRow& b) {
    return std::abs(a.studentised) > std::abs(b.studentised);
  });
  return result;
}

std::optional<SuspectRow> gross_row(const Observations& observations) {
  constexpr double kGross = 6, kFewestLeft = 6;
  if (!observations.blocks_are_rows || observations.other_axes.empty()) return {};
  const std::vector<int> rows = all_rows(observations);
  std::vector<Components> columns;
  for (const std::string& axis : observations.other_axes) columns.push_back({observations.find(axis)->value});
  const Components y = response_components(observations);
  JointFit fit;
  fit.linear.columns = columns;
  fit.variances = CandidateScan(MixedModel(observations, rows), columns, {}).null_fit(y);
  const double dof = degrees_of_freedom(observations, fit, rows);
  if (dof < kFewestLeft) return {};
  const HeldOutErrors errors = predict_held_out(observations, y, columns, fit.variances, rows, rows);
  const std::vector<SuspectRow> suspects = suspect_rows(observations, errors, fit.variances, dof);
  if (suspects.empty() || std::abs(suspects[0].studentised) < kGross) return {};
  return suspects[0];
}

}  // namespace tunnelrig
