#include "analysis/reduction_output.h"

#include "datasets/error.h"
#include "datasets/locations.h"
#include "datasets/open_space.h"

#include <algorithm>
#include <cmath>

#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

namespace tunnelrig {
namespace {

using Json = nlohmann::ordered_json;

/// A number for a cell: what is not known is left empty.
std::string cell(double value, const char* format = "{:.8g}") {
  return std::isfinite(value) ? fmt::format(fmt::runtime(format), value) : std::string();
}

std::string cell(std::optional<double> value) { return value ? fmt::format("{}", *value) : std::string(); }

Json maybe(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

struct BudgetPart {
  const char* name;
  double Budget::*value;
};
constexpr BudgetPart kBudget[] = {{"run", &Budget::run},
                                  {"visit", &Budget::visit},
                                  {"session", &Budget::session},
                                  {"calibration", &Budget::calibration},
                                  {"propellers", &Budget::propellers},
                                  {"tare", &Budget::tare},
                                  {"speed", &Budget::speed},
                                  {"temperature", &Budget::temperature},
                                  {"pressure", &Budget::pressure},
                                  {"model", &Budget::model}};

/// The model in a cell, without commas: "thesis", "air_pressure+rotor_speed", "2".
std::string csv_model(const Reduction& reduction) {
  return reduction.model.version == 0 ? reduction.terms.name() : fmt::format("{}", reduction.model.version);
}

Json value_json(const LocationValue& value, double factor) {
  return {{"mean", factor * value.mean},
          {"std", maybe(factor * value.std)},
          {"standard_uncertainty", maybe(factor * value.standard_uncertainty)},
          {"dof", maybe(value.dof)},
          {"u95", maybe(factor * value.u95)}};
}

/// Of one rotor's coefficient. The thesis's are shares of the total, over one disc; the other conventions
/// are of one rotor, and the total's is their mean.
double rotor_factor(double factor, Convention convention, const Rig& rig) {
  return convention == Convention::kThesis ? factor : factor * rig.rotors;
}

Json location_json(const LocationSummary& location, double factor, double of_rotor, bool has_u) {
  Json json{{"location", location.label}, {"runs", location.runs}, {"sessions", location.sessions}};
  if (location.y_norm) json["y_norm"] = *location.y_norm;
  if (location.z_norm) json["z_norm"] = *location.z_norm;
  json["thrust_N"] = location.thrust_N;
  json["c_t"] = value_json(location.c_t, factor);
  if (has_u) json["u_percent"] = value_json(location.u_percent, 1);
  for (const BudgetPart& part : kBudget)
    json["c_t_budget"][part.name] = factor * (location.budget.*part.value);
  for (const double value : location.c_rotor) json["c_rotor"].push_back(of_rotor * value);
  return json;
}

}  // namespace

std::string locations_csv(const Summary& summary, const Reduction& reduction, const Rig& rig,
                          Convention convention) {
  const double factor = convert_coefficient(1, Convention::kThesis, convention, rig);
  const bool has_u = rig.rotors == kMaxRotors;
  std::string csv =
      "location,y_norm,z_norm,runs,c_t,c_t_std,c_t_u95,u_percent,u_percent_std,u_percent_u95,sessions,thrust_"
      "N";
  for (int rotor = 1; rotor <= rig.rotors; ++rotor) csv += fmt::format(",c_rotor_{}", rotor);
  csv += ",c_t_dof";
  for (const BudgetPart& part : kBudget) csv += fmt::format(",c_t_u_{}", part.name);
  csv += ",convention,model,u95_without\n";
  for (const LocationSummary& location : summary.locations) {
    const auto u_cell = [&](double value) { return has_u ? cell(value, "{:.6f}") : std::string(); };
    csv += fmt::format("{},{},{},{},{},{},{},{},{},{},{},{}", csv_cell(location.label), cell(location.y_norm),
                       cell(location.z_norm), location.runs, cell(factor * location.c_t.mean),
                       cell(factor * location.c_t.std), cell(factor * location.c_t.u95),
                       u_cell(location.u_percent.mean), u_cell(location.u_percent.std),
                       u_cell(location.u_percent.u95), location.sessions, cell(location.thrust_N));
    for (const double value : location.c_rotor)
      csv += "," + cell(rotor_factor(factor, convention, rig) * value);
    csv += "," + cell(location.c_t.dof, "{:.1f}");
    for (const BudgetPart& part : kBudget)
      csv += "," + cell(factor * (location.budget.*part.value), "{:.4g}");
    csv += fmt::format(",{},{},{}\n", name_of(convention), csv_model(reduction),
                       fmt::join(summary.u95_without, "+"));
  }
  return csv;
}

std::string runs_csv(const CampaignData& data, const Reduction& reduction, Convention convention) {
  const double factor = convert_coefficient(1, Convention::kThesis, convention, data.info.rig);
  std::string csv = "run,location,repeat,session,start_utc,c_t,u_percent,density_kg_m3,speed_rpm";
  for (int rotor = 1; rotor <= data.info.rig.rotors; ++rotor) csv += fmt::format(",thrust_{}_N", rotor);
  csv += ",c_t_standard_error,stationary,clipped,zero_from_calibration,convention,model\n";
  for (const RunCoefficients& reduced : reduction.runs) {
    const Run& run = data.runs[reduced.run];
    csv += fmt::format("{},{},{},{},{},{},{},{:.6f},{:.1f}", csv_cell(run.run), csv_cell(run.location),
                       run.repeat, csv_cell(run.session), format_utc(run.start_s), cell(factor * reduced.c_t),
                       cell(reduced.u_percent, "{:.6f}"), reduced.density_kg_m3, reduced.speed_rpm);
    for (int rotor = 0; rotor < data.info.rig.rotors; ++rotor) {
      csv += "," + cell(reduced.thrust_N[static_cast<std::size_t>(rotor)]);
    }
    // The noise of thrusts that stand in the row is not known.
    const double noise = reduced.from_volts ? reduced.c_t_standard_error : std::nan("");
    csv += fmt::format(",{},{},{},{},{},{}\n", cell(factor * noise, "{:.4g}"), reduced.stationary ? 1 : 0,
                       reduced.clipped, reduced.zero_from_calibration ? 1 : 0, name_of(convention),
                       csv_model(reduction));
  }
  return csv;
}

std::string reduction_json(const CampaignData& data, const Reduction& reduction, const Summary& summary,
                           Convention convention) {
  const double factor = convert_coefficient(1, Convention::kThesis, convention, data.info.rig);
  Json json{{"format", "tunnelrig-reduction/1"}, {"campaign", data.info.name},
            {"model", reduction.model_name()},   {"model_version", reduction.model.version},
            {"convention", name_of(convention)}, {"calibration", data.certificate_id},
            {"runs", reduction.runs.size()}};
  json["locations"] = Json::array();
  for (const LocationSummary& location : summary.locations) {
    json["locations"].push_back(location_json(location, factor,
                                              rotor_factor(factor, convention, data.info.rig),
                                              data.info.rig.rotors == kMaxRotors));
  }
  json["left_out"] = Json::array();
  for (const LeftOutRun& run : reduction.left_out) {
    json["left_out"].push_back({{"run", run.run}, {"reason", run.reason}, {"problem", run.problem}});
  }
  json["notes"] = summary.notes;
  json["u95_without"] = summary.u95_without;
  return json.dump(1);
}

MapInput map_input(const CampaignData& data, const Summary& summary, const std::string& source) {
  if (!data.info.tunnel)
    throw InputError::in(source, "campaign.toml has no [tunnel], so there is nothing to map");
  if (data.info.rig.rotors != kMaxRotors)
    throw InputError::in(source, "a map of U needs four rotors; this rig has {}", data.info.rig.rotors);
  MapInput input;
  input.source = source;
  input.geometry = {.vehicle_width_m = data.info.rig.vehicle_width_m,
                    .vehicle_height_m = data.info.rig.vehicle_height_m,
                    .tunnel_width_m = data.info.tunnel->width_m,
                    .tunnel_height_m = data.info.tunnel->height_m,
                    .propeller_radius_m = data.info.rig.propeller_radius_m};
  std::vector<Eigen::Index> rows;
  for (std::size_t l = 0; l < summary.locations.size(); ++l) {
    const LocationSummary& location = summary.locations[l];
    if (location.label == "OS") input.c_t_open_space = location.c_t.mean;
    if (!location.y_norm || !location.z_norm) continue;
    input.locations.push_back(
        {location.label, *location.y_norm, *location.z_norm, location.c_t.mean, location.u_percent.mean});
    rows.push_back(static_cast<Eigen::Index>(l));
    input.scatter_known = input.scatter_known && !std::isnan(location.c_t.standard_uncertainty);
  }
  input.c_t_covariance = summary.c_t_covariance(rows, rows);
  input.u_covariance = summary.u_covariance(rows, rows);
  for (const Eigen::MatrixXd& part : summary.c_t_over_root_dof)
    input.c_t_over_root_dof.emplace_back(part(rows, rows));
  for (const Eigen::MatrixXd& part : summary.u_over_root_dof)
    input.u_over_root_dof.emplace_back(part(rows, rows));
  return input;
}

std::vector<std::string> not_on_the_map(const CampaignData& data, const Summary& summary) {
  std::vector<std::string> labels;
  for (const LocationSummary& location : summary.locations) {
    const bool elsewhere = std::ranges::any_of(data.runs, [&](const Run& run) {
      return canonical_location(run.location) == location.label && in_open_space(run);
    });
    if (!location.y_norm && !elsewhere) labels.push_back(location.label);
  }
  return labels;
}

}  // namespace tunnelrig
