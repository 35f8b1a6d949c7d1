// The files of a map: what `map --out` leaves behind (docs/maps.md).
#pragma once

#include "analysis/maps/disturbance_map.h"
#include "analysis/maps/tunnel_maps.h"

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace tunnelrig {

struct WriteSettings {
  int nodes = 41;                   // of the grid, along each side; odd
  std::string provenance = "{}";    // text of a JSON object, for disturbance_map.json
  std::string gnuplot = "gnuplot";  // the program that draws
  MapProgress progress = {};
};

struct WrittenMaps {
  DisturbanceMap map;
  std::vector<std::filesystem::path> files;
  std::optional<std::string> warning;  // why there are no pictures, or which of another map are left
};

/// Writes into `folder`, which is made where it is missing:
///   disturbance_map.json, delta_ct.csv, uneven_thrust.csv, delta_ct_contours.csv,
///   uneven_thrust_contours.csv, delta_ct.svg, delta_ct_u95.svg, uneven_thrust.svg, uneven_thrust_u95.svg,
///   and the same as .png.
/// Files of that name are replaced, all or none: everything is made in a scratch folder first. Without
/// gnuplot there are no pictures, and the result says why; where the uncertainty is not known there is none
/// of it. Older ones of another map are removed where they can be. Throws InputError where the folder cannot
/// be written or a setting is wrong.
WrittenMaps write_maps(const std::filesystem::path& folder, const TunnelMaps& maps,
                       const WriteSettings& settings = {});

}  // namespace tunnelrig
