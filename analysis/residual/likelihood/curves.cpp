#include "analysis/residual/likelihood/curves.h"

#include <algorithm>

#include <fmt/format.h>

namespace tunnelrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/// That a condition does different things in different places, or under another condition, is less likely
/// beforehand than that it does one.
constexpr double kPlaceWeight = 0.2;

/// What is straight, on the curve's rotors.
MatrixXd straight_over(const Curve& curve) {
  const MatrixXd& column = curve.columns[0][0];
  MatrixXd straight = MatrixXd::Zero(column.rows(), column.cols());
  for (Index row = 0; row < straight.rows(); ++row)
    for (Index c = 0; c < straight.cols(); ++c)
      if (straight.cols() == 1 || curve.rotor < 0 || c == curve.rotor)
        straight(row, c) =
            curve_straight(curve.shape, curve.x(row, curve.x.cols() > 1 ? c : 0), curve.low, curve.high);
  return straight;
}

}  // namespace

std::string Curve::label() const {
  return covariate + (everywhere() ? "" : " × " + place.name) +
         (rotor < 0 ? "" : fmt::format(" of rotor {}", rotor + 1));
}

bool Curve::is_like(const Curve& other) const {
  return covariate == other.covariate && rotor == other.rotor && place.name == other.place.name;
}

bool is_over(const Curve& curve, const std::vector<std::string>& covariates) {
  return std::find(covariates.begin(), covariates.end(), curve.covariate) != covariates.end();
}

Curve without_trend(const Curve& curve, const std::vector<int>& rows) {
  Curve result = curve;
  if (curve.x.size() == 0) return result;
  const MatrixXd straight = straight_over(curve);
  for (Components& column : result.columns) {
    const bool own = column[0].cols() > 1 && curve.rotor >= 0;
    const Index first = own ? curve.rotor : 0, channels = own ? 1 : straight.cols();
    const MatrixXd w = straight.middleCols(first, channels)(rows, Eigen::all),
                   y = column[0].middleCols(first, channels)(rows, Eigen::all);
    const auto centred = w.array() - w.mean();
    result.tilt.push_back((centred * y.array()).sum() / centred.square().sum());
    column[0] -= result.tilt.back() * straight;
  }
  return result;
}

Curve with_trend(const Curve& curve) {
  Curve result = curve;
  if (curve.tilt.empty()) return result;
  const MatrixXd straight = straight_over(curve);
  for (std::size_t k = 0; k < curve.tilt.size(); ++k) result.columns[k][0] += curve.tilt[k] * straight;
  result.tilt.clear();
  if (has_waves(curve.shape)) return result;  // the longest of which is a trend
  Components column(curve.columns[0].size(), MatrixXd::Zero(straight.rows(), straight.cols()));
  column[0] = straight;
  result.columns.push_back(std::move(column));
  return result;
}

bool is_bend_over(const Curve& curve, const std::vector<std::string>& covariates, int rotor) {
  return curve.columns.size() == 1 && curve.shape != CurveShape::kLevels && curve.everywhere() &&
         curve.x.size() > 0 && curve.rotor == rotor && is_over(curve, covariates);
}

Candidate as_candidate(const Curve& curve) {
  // Rotors alone are as likely together as all of them alike, as with named effects.
  const auto channels = static_cast<double>(curve.columns[0][0].cols());
  return {.columns = curve.columns,
          .sign = 0,
          .weight = (curve.rotor < 0 ? 1 : 1 / channels) * (curve.everywhere() ? 1 : kPlaceWeight)};
}

}  // namespace tunnelrig
