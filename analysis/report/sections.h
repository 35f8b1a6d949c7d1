// The report's sections, a function for each: what was derived of a campaign, as the page's scripts take it.
// Internal to analysis/report.
#pragma once

#include "analysis/campaign_data.h"
#include "analysis/health.h"
#include "analysis/location_summary.h"
#include "analysis/maps/tunnel_maps.h"
#include "analysis/report/report_data.h"
#include "analysis/table_reduction.h"

#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace tunnelrig::report {

using Json = nlohmann::ordered_json;

/// Frames of one run, of its ledger, or of its gaps where it was imported without one.
struct Frames {
  std::uint64_t emitted = 0, lost = 0;
};

/// What the sections are made from.
struct Material {
  const CampaignFile& file;
  const ReportSettings& settings;
  CampaignData data;
  std::optional<Reduction> reduction;
  std::optional<Summary> summary;    // with the reduction, or not at all
  std::string not_reduced;           // why there is none
  std::optional<TunnelMaps> fitted;  // with the map on the page's grid, or neither
  std::optional<DisturbanceMap> map;
  std::string not_mapped;
  std::vector<Frames> frames;  // by run; zero where it has no raw data
  std::vector<Finding> findings;
};

/// All but the findings, which take the raw data to be read. Throws InputError for a file that holds nothing.
Material gather(const CampaignFile& file, const ReportSettings& settings);

/// What stands in a section's place.
inline Json absent(const std::string& sentence) { return {{"absent", sentence}}; }

/// NaN and infinity are not known, which is null.
inline Json maybe(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }
inline Json maybe(std::optional<double> value) { return value ? Json(*value) : Json(nullptr); }

/// To as many decimals as a picture shows, so that arrays over all runs stay short.
inline Json rounded(double value, int decimals) {
  const double scale = std::pow(10.0, decimals);
  return maybe(std::round(value * scale) / scale);
}

Json summary_section(const Material& material);
Json maps_section(const Material& material);

/// The reduction's own document: locations with their budgets, what was left out, notes.
Json locations_section(const Material& material);
Json uneven_section(const Material& material);
/// OS, GND… and CEIL…, and where these stand on the axis of z_norm.
Json open_space_section(const Material& material);
Json budget_section(const Material& material);

/// Every adopted version of the model with the explanation that it comes from, newest first; empty where none
/// is.
Json model_section(const CampaignFile& file);

Json calibration_section(const Material& material);

/// A column for each thing that is known of every run, tares and partial ones included.
Json runs_section(const Material& material);
Json health_section(const Material& material);
Json tares_section(const Material& material);
Json findings_section(const Material& material);

/// Every derived document of the file, oldest first.
Json documents_section(const CampaignFile& file);

/// flights.json of `tunnelrig fly --out`. Throws InputError naming file and rule for one that is not such a
/// file.
Json flights_section(const std::string& path);

/// The controller with the smallest error of those whose contacts cannot be told from the fewest, over all
/// scenarios of such a section; null where no controller flew them all. With one scenario also its 95 %
/// interval, and the controllers that the runs cannot tell from it.
Json best_controller(const Json& section);

Json table_section(const ObservationTable& table, const TableReduction& reduction);

}  // namespace tunnelrig::report
