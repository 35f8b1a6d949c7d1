// disturbance_map.json: the one file that carries a measured field from the rig to flight (docs/maps.md).
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tunnelrig {

/// What turns metres into normalised coordinates and back: ȳ = 2y/(w_t − w_q), z̄ = 2z/(h_t − h_q) (4.1, 4.2).
struct MapGeometry {
  double vehicle_width_m = 0;     // w_q, tip to tip
  double vehicle_height_m = 0;    // h_q
  double tunnel_width_m = 0;      // w_t
  double tunnel_height_m = 0;     // h_t
  double propeller_radius_m = 0;  // R
};

/// A square grid over [−1, 1]²: rows follow z̄ from ground to ceiling, columns ȳ from the left wall to the
/// right.
struct MapGrid {
  std::vector<double> y_norm, z_norm;  // strictly increasing, −1 to 1, each with a node at exactly 0

  std::size_t nodes() const { return y_norm.size() * z_norm.size(); }
  std::size_t index(std::size_t row, std::size_t column) const { return row * y_norm.size() + column; }
};

/// One quantity on the grid, in per cent, row-major: node (row, column) is at MapGrid::index.
struct MapLayer {
  std::vector<double> value_percent;
  std::vector<double> u95_percent;  // half width of the 95 % interval; not negative; NaN: not known

  bool u95_known() const;  // at every node
};

/// One measured location, as measured: U is not zero on the centre line here and holds the rig's offset, ΔC_T
/// is zero at OT. A u95 of NaN is not known.
struct MeasuredLocation {
  std::string label;
  double y_norm = 0, z_norm = 0;
  double delta_ct_percent = 0, delta_ct_u95_percent = 0;
  double uneven_thrust_percent = 0, uneven_thrust_u95_percent = 0;
};

/// How well the map predicts a location that it was not shown.
struct LeaveOneOutSummary {
  int locations = 0;       // left out one after the other; those that symmetry alone decides do not count
  double rms_percent = 0;  // percentage points
  std::optional<double>
      standardised_rms;  // errors over their standard uncertainty; near 1 where that is right
};

/// What the rig reads of U where symmetry demands 0; in the measured values, and taken out of the map.
struct RigOffset {
  double value_percent = 0;
  double u95_percent = 0;  // half width of the 95 % interval; NaN: not known

  /// Beyond its own uncertainty.
  bool significant() const;
};

struct FitSummary {
  std::map<std::string, double> hyperparameters;
  LeaveOneOutSummary leave_one_out;
  std::optional<RigOffset> offset;  // of U
};

struct DisturbanceMap {
  MapGeometry geometry;
  MapGrid grid;
  MapLayer delta_ct;       // (C_T / C_T0 − 1) · 100, the change that (5.2) means; exactly 0 at OT
  MapLayer uneven_thrust;  // U (5.1): right pair minus left pair, so that a negative U rolls to the right
  std::vector<MeasuredLocation> locations;
  std::string method;          // "gaussian-process" or "thin-plate-spline"
  double coverage_factor = 0;  // u95 over the standard deviation of the normal error of that 95 % interval
  double c_t_origin = 0;       // C_T0, at OT
  std::optional<double> c_t_open_space;
  FitSummary delta_ct_fit, uneven_thrust_fit;
  std::string provenance = "{}";  // a JSON object, carried as it is
};

/// The file's text. The map must be a valid one: broken rules of shape are bugs here.
std::string format_disturbance_map(const DisturbanceMap& map);

/// Parses the text of a map; `file` is how messages name it. Throws InputError naming file and key for text
/// that is no JSON, another format, a missing key, a value of the wrong type or shape, a number that is not
/// finite, or one that no map has (a vehicle wider than its tunnel, a grid that does not span [−1, 1]²).
DisturbanceMap parse_disturbance_map(std::string_view text, const std::string& file);

/// Reads and parses a file.
DisturbanceMap read_disturbance_map(const std::filesystem::path& path);

}  // namespace tunnelrig
