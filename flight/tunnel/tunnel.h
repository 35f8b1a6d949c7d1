// A tunnel: its cross-section and length, by name or from a file (docs/localisation.md has the format).
#pragma once

#include "flight/tunnel/cross_section.h"

#include <filesystem>
#include <optional>
#include <string>

namespace tunnelrig {

struct FlightTunnel {
  std::string name;
  CrossSection section;
  double length_m = 0;
  double circle_diameter_m = 0;         // 0 where the section is no circle
  std::optional<SectionBox> plain_box;  // without small features, where there are such

  /// What floor, middle and size go by: a refuge bay makes no tunnel wider.
  SectionBox box() const { return plain_box.value_or(section.box()); }
};

/// "1.5" (1.5 × 1.5 × 2.5 m), "2.4" (2.35 × 2.39 × 6.06 m) and "railway" (4.5 × 5.0 m, half-circular arch) of
/// the thesis, or else the file of that name. Throws InputError for neither.
FlightTunnel tunnel_from(const std::string& name_or_file);

/// Throws InputError naming file, line and the rule broken.
FlightTunnel parse_tunnel(const std::string& toml, const std::string& file);
FlightTunnel read_tunnel(const std::filesystem::path& path);

}  // namespace tunnelrig
