// Location labels of the thesis (Table 4.1) and what they mean.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tunnelrig {

struct TunnelPoint {
  double y_norm = 0;
  double z_norm = 0;
};

/// The point of a label of the thesis's grid, "H4V-2" or "OT"; nothing for any other label.
std::optional<TunnelPoint> grid_point(std::string_view label);

/// `OT` and `H0V0` are one location: the label that stands for both.
std::string canonical_location(std::string_view label);

/// "GND1.25" → 1.25 with prefix "GND"; nothing where the label is of another form.
std::optional<double> distance_of(std::string_view label, std::string_view prefix);

/// The 42 tunnel locations, column by column from the centre, `OT` for H0V0.
std::vector<std::string> tunnel_grid();

/// The open-space experiments: OS, GND…, CEIL…
std::vector<std::string> open_space_grid();

}  // namespace tunnelrig
