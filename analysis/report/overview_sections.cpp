// The numbers that matter, where everything came from, and tables of other rigs.
#include "analysis/report/sections.h"

#include <algorithm>
#include <set>
#include <tuple>

#include <fmt/format.h>

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

Json value_in_tunnel(const MeasuredLocation& location, double value, double u95) {
  Json json = value_at(location.label, value, u95);
  json["y_norm"] = location.y_norm;
  json["z_norm"] = location.z_norm;
  return json;
}

/// Of the measured locations: in between a map is an estimate, and its extremes are those of its grid.
void add_extremes_of_map(const Material& material, Json& json) {
  if (!material.map) {
    json["missing"].push_back(
        fmt::format("There is no map, and so no maximum of ΔC_T: {}.", material.not_mapped));
    return;
  }
  const auto& locations = material.map->locations;
  const auto [least, greatest] = std::minmax_element(
      locations.begin(), locations.end(),
      [](const auto& a, const auto& b) { return a.delta_ct_percent < b.delta_ct_percent; });
  json["greatest_delta_ct_percent"] =
      value_in_tunnel(*greatest, greatest->delta_ct_percent, greatest->delta_ct_u95_percent);
  json["least_delta_ct_percent"] =
      value_in_tunnel(*least, least->delta_ct_percent, least->delta_ct_u95_percent);
}

/// Of the tunnel's field where a map tells it from the rig's offset: without that a campaign with an offset
/// would show the place where the field helps it most, and one on the middle plane where there is none.
void add_extreme_of_field(const Material& material, Json& json) {
  const std::vector<MeasuredField> field = measured_field(material.fitted->uneven_thrust);
  const auto greatest =
      std::max_element(field.begin(), field.end(), [](const MeasuredField& a, const MeasuredField& b) {
        return std::abs(a.field.value) < std::abs(b.field.value);
      });
  if (greatest == field.end()) {
    json["missing"].push_back(
        "Every measured location is on the tunnel's middle plane, where the uneven thrust U is 0 by "
        "symmetry.");
    return;
  }
  const auto& locations = material.map->locations;
  const auto here = std::ranges::find(locations, greatest->label, &MeasuredLocation::label);
  const double sign = here->y_norm < 0 ? -1 : 1;
  Json& value = json["greatest_uneven_percent"] =
      value_in_tunnel(*here, sign * greatest->field.value, greatest->field.u95());
  value["as_measured"] = here->uneven_thrust_percent;
  if (const auto& offset = material.map->uneven_thrust_fit.offset) {
    value["offset"] = offset->value_percent;
    value["offset_u95"] = maybe(offset->u95_percent);
  }
}

/// As measured, where no map tells the rig's offset from the field: of the locations off the middle plane,
/// else of the tunnel's, else of all.
void add_extreme_as_measured(const Material& material, Json& json) {
  const LocationSummary* greatest = nullptr;
  const auto rank = [](const LocationSummary& location) {
    return std::tuple(location.y_norm.value_or(0) != 0, location.y_norm.has_value(),
                      std::abs(location.u_percent.mean));
  };
  for (const LocationSummary& location : material.summary->locations) {
    if (greatest == nullptr || rank(*greatest) < rank(location)) greatest = &location;
  }
  if (greatest == nullptr) return;
  Json& value = json["greatest_uneven_percent"] =
      value_at(greatest->label, greatest->u_percent.mean, greatest->u_percent.u95);
  value["as_measured"] = greatest->u_percent.mean;
  if (greatest->y_norm) {
    value["y_norm"] = *greatest->y_norm;
    value["z_norm"] = *greatest->z_norm;
  }
}

void add_extreme_of_u(const Material& material, Json& json) {
  if (material.data.info.rig.rotors != kMaxRotors)
    json["missing"].push_back("There is no uneven thrust U: it compares two pairs of rotors.");
  else if (material.map)
    add_extreme_of_field(material, json);
  else
    add_extreme_as_measured(material, json);
}

/// The effects that the coefficients are corrected for, and what that gained on blocks held out.
void add_model(const Material& material, Json& json) {
  const auto& version = material.settings.model.version;
  if (!version) {
    json["missing"].push_back(
        "No adopted effect is in force, so there is no error before and after (`tunnelrig explain "
        "--adopt`).");
    return;
  }
  const Json explanation = Json::parse(version->explanation);
  json["model"] = {{"name", version->name()}, {"effects", version->effects()}};
  for (const char* key : {"unit", "before", "after", "noise_floor"})
    json["model"][key] = explanation.value(key, Json());
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
  json["missing"] = Json::array();
  if (!material.summary) {
    json["missing"].push_back(fmt::format("There are no coefficients: {}.", material.not_reduced));
    return json;
  }
  json["reduced_runs"] = material.reduction->runs.size();
  json["locations"] = material.summary->locations.size();
  json["u95_without"] = material.summary->u95_without;
  for (const LocationSummary& location : material.summary->locations) {
    if (location.label == "OS" || location.label == "OT")
      json["c_t"].push_back(value_at(location.label, location.c_t.mean, location.c_t.u95));
  }
  add_extremes_of_map(material, json);
  add_extreme_of_u(material, json);
  add_model(material, json);
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
            {"response_unit", table.schema.response.unit == "1" ? "" : table.schema.response.unit},
            {"convention", name_of(reduction.convention)},
            {"reduced", reduction.rows.size()},
            {"unknown", reduction.unknown},
            {"at_rest", reduction.at_rest},
            {"doubtful_rows", reduction.doubtful},
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
