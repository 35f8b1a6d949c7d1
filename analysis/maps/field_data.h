// The two fields that a map shows, as observations: the change of thrust against OT, and the uneven thrust.
#pragma once

#include "analysis/maps/map_input.h"
#include "datasets/locations.h"

#include <string>
#include <vector>

#include <Eigen/Core>

namespace tunnelrig {

/// How a field continues on the other side of the tunnel's middle plane.
enum class Parity {
  kEven,  // ΔC_T: f(−ȳ, z̄) = f(ȳ, z̄)
  kOdd    // U: f(−ȳ, z̄) = −f(ȳ, z̄)
};

/// n observations of a field that is 0 at OT, folded onto ȳ ≥ 0, one per position; per cent throughout. Of an
/// odd field measured on both sides there is one more, labelled "mirror images": what the differences between
/// images say of the rig's offset, which stands on ȳ = 0, as locations there say the same.
struct FieldData {
  Parity parity = Parity::kEven;
  std::vector<std::string> labels;
  std::vector<TunnelPoint> points;  // ȳ ≥ 0
  Eigen::VectorXd values;
  Eigen::MatrixXd covariance;  // of the measurement, n × n
  /// What would be added to `covariance` if each location had one more error of variance 1, independent of
  /// the others. Not the identity for ΔC_T: OT's share of it reaches every other location.
  Eigen::MatrixXd excess;
  /// What an offset of the rig of 1 adds to each value (rig_offset.h): 1 on the right, −1 on the left, 0 for
  /// ΔC_T, in which no offset is told from a field.
  Eigen::VectorXd offset_column;
  std::vector<Eigen::MatrixXd> over_root_dof;  // of each source of the measured covariance (Summary)
  bool scatter_known = true;                   // of MapInput

  Eigen::Index size() const { return values.size(); }
};

/// ΔC_T = (C_T / C_T0 − 1) · 100 (5.2) at every location but OT, where it is 0 by definition; its covariance
/// by the delta method, so that OT's own error is shared by all others. Takes what merge_locations returns.
/// Throws InputError where mirror images differ and their covariance says that they cannot.
FieldData thrust_change_data(const MapInput& merged);

/// U at every location. Takes and throws as thrust_change_data.
FieldData uneven_thrust_data(const MapInput& merged);

/// One observation fewer.
FieldData without(const FieldData& data, Eigen::Index left_out);

/// C_T0.
double thrust_coefficient_at_origin(const MapInput& merged);

/// Degrees of freedom of Σ w_i measured_i plus what is known exactly, together of that variance (Welch and
/// Satterthwaite): infinite where no source has any, and never below 1.
double effective_dof(const std::vector<Eigen::MatrixXd>& over_root_dof, const Eigen::VectorXd& weights,
                     double variance);

/// The locations as measured, on the side of the tunnel where they were; u95 by Student's t, NaN where the
/// scatter is not known.
std::vector<MeasuredLocation> measured_locations(const MapInput& merged);

}  // namespace tunnelrig
