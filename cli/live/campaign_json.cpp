#include "cli/live/campaign_json.h"

#include "analysis/location_summary.h"
#include "analysis/maps/tunnel_maps.h"
#include "analysis/reduction_output.h"
#include "datasets/locations.h"

#include <algorithm>
#include <cmath>

#include <nlohmann/json.hpp>

namespace tunnelrig::live {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kMapNodes = 21;

Json number_or_null(const std::optional<double>& value) { return value ? Json(*value) : Json(nullptr); }

struct Place {
  std::string label;
  std::optional<double> y_norm, z_norm;
  int planned = 0, done = 0;
};

bool is_complete(const CampaignData& data, const Run& run) {
  const auto raw = data.raw.find(run.run);
  return run.excluded.empty() && (raw == data.raw.end() || raw->second.state == RunState::kComplete);
}

class Places {
 public:
  explicit Places(bool tunnel) : tunnel_(tunnel) {}

  Place& at(const std::string& location, std::optional<double> y_norm, std::optional<double> z_norm) {
    const std::string label = canonical_location(location);
    const auto [found, fresh] = index_.emplace(label, places_.size());
    if (fresh) {
      places_.push_back({label, y_norm, z_norm});
      const auto point = grid_point(label);
      if (!y_norm && point && tunnel_) {
        places_.back().y_norm = point->y_norm;
        places_.back().z_norm = point->z_norm;
      }
    }
    return places_[found->second];
  }
  const std::vector<Place>& all() const { return places_; }

 private:
  bool tunnel_;
  std::map<std::string, std::size_t> index_;
  std::vector<Place> places_;
};

const char* state_of(const Place& place, const Position& position) {
  const bool finished = place.done > 0 && place.done >= place.planned;
  const bool here = canonical_location(position.run.location) == place.label;
  if (position.phase == Phase::kRecording && here && position.run.kind == RunKind::kThrust) return "present";
  if (finished) return "done";
  if (here && !position.run.run.empty() && position.phase != Phase::kFinished) return "present";
  if (!position.next_location.empty() && canonical_location(position.next_location) == place.label)
    return "next";
  return place.done > 0 ? "partial" : "planned";
}

/// Thrust runs by location; the plan's places first, in its order.
Json locations_json(const CampaignStand& stand) {
  Places places(stand.data->info.tunnel.has_value());
  for (const PlannedRun& planned : stand.plan) {
    if (planned.kind == RunKind::kThrust)
      ++places.at(planned.location, planned.y_norm, planned.z_norm).planned;
  }
  for (const Run& run : stand.data->runs) {
    if (run.kind != RunKind::kThrust) continue;
    Place& place = places.at(run.location, run.y_norm, run.z_norm);
    place.done += is_complete(*stand.data, run) ? 1 : 0;
  }
  Json json = Json::array();
  for (const Place& place : places.all()) {
    json.push_back({{"label", place.label},
                    {"y_norm", number_or_null(place.y_norm)},
                    {"z_norm", number_or_null(place.z_norm)},
                    {"planned", place.planned},
                    {"done", place.done},
                    {"state", state_of(place, stand.position)}});
  }
  return json;
}

Json parts_of(const std::string& text, char separator) {
  Json parts = Json::array();
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find(separator, at), text.size());
    if (end > at) parts.push_back(text.substr(at, end - at));
    at = end + 1;
  }
  return parts;
}

Json runs_json(const CampaignStand& stand) {
  const CampaignData& data = *stand.data;
  std::map<std::size_t, const RunCoefficients*> reduced;
  if (stand.reduction != nullptr) {
    for (const RunCoefficients& run : stand.reduction->runs) reduced[run.run] = &run;
  }
  Json json = Json::array();
  for (std::size_t r = 0; r < data.runs.size(); ++r) {
    const Run& run = data.runs[r];
    const auto raw = data.raw.find(run.run);
    const auto lost = stand.lost.find(run.run);
    const auto found = reduced.find(r);
    const bool has_u = found != reduced.end() && std::isfinite(found->second->u_percent);
    json.push_back({{"run", run.run},
                    {"location", canonical_location(run.location)},
                    {"session", run.session},
                    {"repeat", run.repeat},
                    {"kind", run.kind == RunKind::kTare ? "tare" : "thrust"},
                    {"start_utc", format_utc(run.start_s)},
                    {"state", raw == data.raw.end() ? "complete" : name_of(raw->second.state)},
                    {"frames", raw == data.raw.end() ? 0 : raw->second.frames},
                    {"lost", lost == stand.lost.end() ? 0 : lost->second},
                    {"c_t", found != reduced.end() ? Json(found->second->c_t) : Json(nullptr)},
                    {"u_percent", has_u ? Json(found->second->u_percent) : Json(nullptr)},
                    {"alarms", parts_of(run.alarms, ';')},
                    {"excluded", run.excluded.empty() ? Json(nullptr) : Json(run.excluded)},
                    {"notes", parts_of(run.note, '\n')}});
  }
  return json;
}

Json layer_json(const MapGrid& grid, const MapLayer& layer) {
  Json value = Json::array(), u95 = Json::array();
  for (std::size_t row = 0; row < grid.z_norm.size(); ++row) {
    Json value_row = Json::array(), u95_row = Json::array();
    for (std::size_t column = 0; column < grid.y_norm.size(); ++column) {
      value_row.push_back(layer.value_percent[grid.index(row, column)]);
      u95_row.push_back(layer.u95_percent[grid.index(row, column)]);
    }
    value.push_back(std::move(value_row));
    u95.push_back(std::move(u95_row));
  }
  return {{"y_norm", grid.y_norm}, {"z_norm", grid.z_norm}, {"value_percent", value}, {"u95_percent", u95}};
}

}  // namespace

std::string campaign_json(const CampaignStand& stand) {
  Json json{{"locations", locations_json(stand)}, {"runs", runs_json(stand)}};
  std::string text = json.dump(-1, ' ', false, Json::error_handler_t::replace);
  text.pop_back();  // maps are JSON already
  const Json reason = stand.maps_reason.empty() ? Json(nullptr) : Json(stand.maps_reason);
  return text + ",\"maps\":" + stand.maps +
         ",\"maps_reason\":" + reason.dump(-1, ' ', false, Json::error_handler_t::replace) + "}";
}

std::string maps_json(const CampaignData& data, const Reduction& reduction) {
  const Summary summary = summarize_locations(data, reduction);
  const TunnelMaps maps = fit_maps(map_input(data, summary, "campaign"));
  const MapGrid grid = regular_grid(kMapNodes);
  const Json json{{"delta_ct", layer_json(grid, sample(maps.delta_ct, grid))},
                  {"uneven_thrust", layer_json(grid, sample(maps.uneven_thrust, grid))}};
  return json.dump();
}

}  // namespace tunnelrig::live
