// The numbers that matter, where everything came from, and tables of other rigs.
#include "analysis/report/sections.h"

#include <algorithm>
#include <set>

namespace tunnelrig::report {
namespace {

/// Where the runs come from, as the column `source` says that the recorder writes.
Json origins(const CampaignData& data) {
  int simulated = 0, measured = 0, unknown = 0;
  for (const Run& run : data.runs) {
    const auto source = run.labels.find("source");
    ++(source == run.labels.end() ? unknown : source->second == "virtual" ? simulated : measured);
  }
  return {{"simulated", simulated}, {"measured", measured}, {"unknown", unknown}};
}

Json value_at(const std::string& location, double value, double u95) {
  return {{"location", location}, {"value", value}, {"u95", maybe(u95)}};
}

void add_extremes_of_map(const DisturbanceMap& map, Json& json) {
  const auto [least, greatest] = std::minmax_element(
      map.locations.begin(), map.locations.end(),
      [](const auto& a, const auto& b) { return a.delta_ct_percent < b.delta_ct_percent; });
  json["greatest_delta_ct_percent"] =
      value_at(greatest->label, greatest->delta_ct_percent, greatest->delta_ct_u95_percent);
  json["least_delta_ct_percent"] =
      value_at(least->label, least->delta_ct_percent, least->delta_ct_u95_percent);
}

/// Of the tunnel's locations; of all where none is in a tunnel.
void add_extreme_of_u(const Summary& summary, Json& json) {
  const LocationSummary* greatest = nullptr;
  const auto rank = [](const LocationSummary& location) {
    return std::pair(location.y_norm.has_value(), std::abs(location.u_percent.mean));
  };
  for (const LocationSummary& location : summary.locations) {
    if (greatest == nullptr || rank(*greatest) < rank(location)) greatest = &location;
  }
  if (greatest == nullptr) return;
  json["greatest_uneven_percent"] =
      value_at(greatest->label, greatest->u_percent.mean, greatest->u_percent.u95);
}

}  // namespace

Json summary_section(const Material& material) {
  const CampaignData& data = material.data;
  Json json{{"origins", origins(data)}};
  std::set<std::string> sessions;
  for (const Run& run : data.runs) sessions.insert(run.session);
  json["runs"] = data.runs.size();
  json["sessions"] = sessions.size();
  std::uint64_t emitted = 0, lost = 0;
  for (const Frames& frames : material.frames) {
    emitted += frames.emitted;
    lost += frames.lost;
  }
  json["frames_emitted"] = emitted;
  json["frames_lost"] = lost;
  if (data.certificate) json["calibration_passed"] = data.certificate->passed();
  if (!material.summary) return json;
  json["reduced_runs"] = material.reduction->runs.size();
  json["locations"] = material.summary->locations.size();
  for (const LocationSummary& location : material.summary->locations) {
    if (location.label == "OS" || location.label == "OT")
      json["c_t"].push_back(value_at(location.label, location.c_t.mean, location.c_t.u95));
  }
  if (material.map) add_extremes_of_map(*material.map, json);
  if (data.info.rig.rotors == kMaxRotors) add_extreme_of_u(*material.summary, json);
  return json;
}

Json documents_section(const CampaignFile& file) {
  std::vector<Document> documents;
  for (const char* kind : {"calibration", "reduction", "map", "model"}) {
    for (Document& document : file.documents(kind)) documents.push_back(std::move(document));
  }
  std::sort(documents.begin(), documents.end(), [](const auto& a, const auto& b) { return a.id < b.id; });
  Json json = Json::array();
  for (const Document& document : documents) {
    json.push_back({{"id", document.id},
                    {"kind", document.kind},
                    {"created_utc", document.created_utc},
                    {"program", document.provenance.program_version},
                    {"arguments", document.provenance.arguments},
                    {"inputs", Json::parse(document.provenance.inputs)}});
  }
  return json;
}

Json table_section(const ObservationTable& table, const TableReduction& reduction) {
  Json json{{"response", table.schema.response.column},
            {"response_unit", table.schema.response.unit},
            {"convention", name_of(reduction.convention)},
            {"reduced", reduction.rows.size()},
            {"unknown", reduction.unknown},
            {"at_rest", reduction.at_rest},
            {"doubtful_lines", reduction.doubtful},
            {"groups", Json::array()}};
  for (const TableGroup& group : reduction.groups) {
    Json columns{{"group", group.name}, {"median", group.median}, {"spread", group.spread}};
    for (const std::size_t row : group.rows) {
      const bool has_speed = table.rows[reduction.rows[row].observation].speed_rpm.has_value();
      columns["speed_rpm"].push_back(has_speed ? rounded(reduction.rows[row].speed_rpm, 1) : Json(nullptr));
      columns["c_t"].push_back(reduction.rows[row].c_t);
    }
    json["groups"].push_back(std::move(columns));
  }
  return json;
}

}  // namespace tunnelrig::report
