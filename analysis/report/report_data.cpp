#include "analysis/report/report_data.h"

#include "analysis/report/sections.h"
#include "datasets/error.h"

#include <utility>

namespace tunnelrig {
namespace {

using report::Json;
using report::Material;

Material examined(const CampaignFile& file, const ReportSettings& settings,
                  const std::function<void(std::size_t, std::size_t)>& progress) {
  Material material = report::gather(file, settings);
  material.findings = examine(file, material.data, progress);
  return material;
}

Json campaign_document(const Material& material) {
  return {{"kind", "campaign"},
          {"name", material.data.info.name},
          {"rotors", material.data.info.rig.rotors},
          {"nominal_speed_rpm", material.data.info.rig.nominal_speed_rpm},
          {"summary", report::summary_section(material)},
          {"runs", report::runs_section(material)},
          {"sections",
           {{"maps", report::maps_section(material)},
            {"locations", report::locations_section(material)},
            {"open_space", report::open_space_section(material)},
            {"uneven", report::uneven_section(material)},
            {"budget", report::budget_section(material)},
            {"calibration", report::calibration_section(material)},
            {"health", report::health_section(material)},
            {"tares", report::tares_section(material)},
            {"findings", report::findings_section(material)},
            {"provenance", report::documents_section(material.file)}}}};
}

Json table_document(const CampaignFile& file) {
  const ObservationTable table = observations_of(file);
  Json coefficients;
  try {
    coefficients = report::table_section(table, reduce_table_rows(table, Convention::kPropeller));
  } catch (const InputError& error) {
    coefficients = report::absent(fmt::format("There is no C_T to show: {}.", error.what()));
  }
  return {{"kind", "table"},
          {"name", table.schema.name},
          {"observations", table.rows.size()},
          {"sections", {{"table", coefficients}, {"provenance", report::documents_section(file)}}}};
}

}  // namespace

ReportData report_data(const CampaignFile& file, const ReportSettings& settings,
                       const std::function<void(std::size_t, std::size_t)>& progress) {
  if (file.empty())
    throw InputError::in(settings.db, "holds neither a campaign nor a table, so there is nothing to report");
  Json document{{"format", "tunnelrig-report/1"},
                {"made",
                 {{"program", "tunnelrig " + settings.program_version},
                  {"arguments", settings.arguments},
                  {"created_utc", settings.created_utc},
                  {"db", settings.db},
                  {"model", settings.model.name()}}}};
  document.update(file.text("table.toml") ? table_document(file)
                                          : campaign_document(examined(file, settings, progress)));
  if (Json models = report::model_section(file); !models.empty())
    document["sections"]["model"] = std::move(models);
  if (!settings.flights.empty()) {
    Json flights = report::flights_section(settings.flights);
    document["summary"]["flown"] = report::best_controller(flights);
    document["sections"]["flights"] = std::move(flights);
  } else {
    document["summary"]["missing"].push_back(
        "No flights were given, so there is no best controller (`--flights`).");
  }
  ReportData data;
  for (const auto& [name, section] : document["sections"].items()) {
    if (section.contains("absent")) data.absent.push_back({name, section["absent"].get<std::string>()});
  }
  data.json = document.dump(-1, ' ', false, Json::error_handler_t::replace);  // paths need not be UTF-8
  return data;
}

}  // namespace tunnelrig
