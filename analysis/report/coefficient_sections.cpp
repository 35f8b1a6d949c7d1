// C_T and U by location, and what of them stands in open space.
#include "analysis/conventions.h"
#include "analysis/reduction_output.h"
#include "analysis/report/sections.h"
#include "datasets/locations.h"

#include <algorithm>

#include <fmt/format.h>

namespace tunnelrig::report {
namespace {

/// How far from a ground or ceiling plane the rotors of an open-space location are.
struct Placement {
  const char* side = nullptr;  // "ground" or "ceiling"
  double distance_R = 0;
};

/// From the label, or for labels of another form from the columns of a run there.
std::optional<Placement> placement(const CampaignData& data, const std::string& label) {
  if (const auto distance = distance_of(label, "GND")) return Placement{"ground", *distance};
  if (const auto distance = distance_of(label, "CEIL")) return Placement{"ceiling", *distance};
  const auto run = std::find_if(data.runs.begin(), data.runs.end(), [&](const Run& candidate) {
    return canonical_location(candidate.location) == label && !candidate.in_tunnel();
  });
  if (run == data.runs.end()) return {};
  if (const auto distance = run->number("ground_distance_R")) return Placement{"ground", *distance};
  if (const auto distance = run->number("ceiling_distance_R")) return Placement{"ceiling", *distance};
  return {};
}

/// z̄ of the place in the tunnel that is as far from its floor or ceiling (4.2).
double z_norm_of(const Placement& placement, const CampaignInfo& info) {
  const double gap_m = placement.distance_R * info.rig.propeller_radius_m;
  const double height_m = 0.5 * info.tunnel->height_m - gap_m;  // from the tunnel's middle towards that side
  const double z_norm = 2 * height_m / (info.tunnel->height_m - info.rig.vehicle_height_m);
  return std::string_view(placement.side) == "ground" ? -z_norm : z_norm;
}

}  // namespace

Json locations_section(const Material& material) {
  if (!material.summary) return absent(fmt::format("There is no C_T: {}.", material.not_reduced));
  Json json =
      Json::parse(reduction_json(material.data, *material.reduction, *material.summary, Convention::kThesis));
  json["area"] = area_in_words(material.data.info.rig);
  return json;
}

Json uneven_section(const Material& material) {
  if (!material.summary) return absent(fmt::format("There is no U: {}.", material.not_reduced));
  const int rotors = material.data.info.rig.rotors;
  if (rotors != kMaxRotors) {
    return absent(fmt::format("Uneven thrust compares two pairs of rotors; this rig has {} rotor{}.", rotors,
                              rotors == 1 ? "" : "s"));
  }
  return Json::object();
}

Json open_space_section(const Material& material) {
  if (!material.summary) return absent(fmt::format("There is nothing to compare: {}.", material.not_reduced));
  Json json{
      {"open_space", nullptr}, {"planes", Json::array()}, {"tunnel", material.data.info.tunnel.has_value()}};
  for (const LocationSummary& location : material.summary->locations) {
    if (location.label == "OS") json["open_space"] = location.label;
    if (location.y_norm) continue;
    const auto place = placement(material.data, location.label);
    if (!place) continue;
    const auto& tunnel = material.data.info.tunnel;
    json["planes"].push_back(
        {{"location", location.label},
         {"side", place->side},
         {"distance_R", place->distance_R},
         {"z_norm", tunnel ? Json(z_norm_of(*place, material.data.info)) : Json(nullptr)}});
  }
  const auto& locations = material.summary->locations;
  const bool has_tunnel =
      std::any_of(locations.begin(), locations.end(),
                  [](const LocationSummary& location) { return location.y_norm.has_value(); });
  if (json["planes"].empty() && json["open_space"].is_null()) {
    return absent(
        "The campaign has no runs in open space (OS), above a ground plane (GND) or beneath a ceiling plane "
        "(CEIL), so there is nothing to hold the tunnel against.");
  }
  if (json["planes"].empty() && !has_tunnel)
    return absent("The campaign has no runs in a tunnel or near a plane to hold against open space (OS).");
  return json;
}

Json budget_section(const Material& material) {
  if (!material.summary)
    return absent(fmt::format("There is no uncertainty budget: {}.", material.not_reduced));
  const auto& locations = material.summary->locations;
  if (std::none_of(locations.begin(), locations.end(),
                   [](const LocationSummary& location) { return location.c_t.standard_uncertainty > 0; })) {
    return absent(
        "Nothing in the campaign says how uncertain its C_T is: no run was repeated, and there is no raw "
        "data and no calibration.");
  }
  return Json::object();
}

}  // namespace tunnelrig::report
