#include "analysis/maps/measured_region.h"
#include "analysis/report/sections.h"

#include <fmt/format.h>

namespace tunnelrig::report {
namespace {

Json layer_json(const MapLayer& layer, const FitSummary& fit) {
  Json json{{"value_percent", layer.value_percent},
            {"u95_percent", layer.u95_percent},
            {"hyperparameters", fit.hyperparameters},
            {"leave_one_out_rms_percent", fit.leave_one_out.rms_percent}};
  json["leave_one_out_standardised"] = maybe(fit.leave_one_out.standardised_rms);
  if (fit.offset) json["offset"] = {fit.offset->value_percent, maybe(fit.offset->u95_percent)};
  return json;
}

/// Lines over what lies beyond the locations, as one that has gaps.
Json beyond_json(const MeasuredRegion& region) {
  constexpr double kApart = 0.05;
  Json json{{"percent", 100 * region.share_outside()}, {"y_norm", Json::array()}, {"z_norm", Json::array()}};
  for (const std::vector<TunnelPoint>& line : hatching(region, kApart)) {
    for (const TunnelPoint& point : line) {
      json["y_norm"].push_back(rounded(point.y_norm, 4));
      json["z_norm"].push_back(rounded(point.z_norm, 4));
    }
    for (const char* axis : {"y_norm", "z_norm"}) json[axis].push_back(nullptr);
  }
  return json;
}

}  // namespace

Json maps_section(const Material& material) {
  if (!material.map) return absent(fmt::format("There are no maps: {}.", material.not_mapped));
  const DisturbanceMap& map = *material.map;
  const MapGeometry& geometry = map.geometry;
  Json json{{"method", map.method},
            {"y_norm", map.grid.y_norm},
            {"z_norm", map.grid.z_norm},
            {"y_m_per_norm", (geometry.tunnel_width_m - geometry.vehicle_width_m) / 2},    // (4.1)
            {"z_m_per_norm", (geometry.tunnel_height_m - geometry.vehicle_height_m) / 2},  // (4.2)
            {"delta_ct", layer_json(map.delta_ct, map.delta_ct_fit)},
            {"uneven_thrust", layer_json(map.uneven_thrust, map.uneven_thrust_fit)},
            {"beyond", beyond_json(measured_region(map))},
            {"locations", Json::array()}};
  for (const MeasuredLocation& location : map.locations) {
    json["locations"].push_back(
        {{"location", location.label},
         {"y_norm", location.y_norm},
         {"z_norm", location.z_norm},
         {"delta_ct", {location.delta_ct_percent, location.delta_ct_u95_percent}},
         {"uneven_thrust", {location.uneven_thrust_percent, location.uneven_thrust_u95_percent}}});
  }
  return json;
}

}  // namespace tunnelrig::report
