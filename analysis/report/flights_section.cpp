#include "analysis/report/flights_ranking.h"
#include "datasets/csv.h"
#include "datasets/error.h"

#include <algorithm>

namespace tunnelrig::report {
namespace {

constexpr const char* kFormat = "tunnelrig-flights/1";

bool are_numbers(const Json& values) {
  return values.is_array() &&
         std::all_of(values.begin(), values.end(), [](const Json& v) { return v.is_number(); });
}

/// One for each run; null where a flight was lost.
bool are_of_runs(const Json& values, const Json& controller) {
  return values.is_array() && values.size() == controller["runs"].get<std::size_t>() &&
         std::all_of(values.begin(), values.end(),
                     [&](const Json& v) { return v.is_number() || (v.is_null() && has_lost(controller)); });
}

bool is_path(const Json& path) {
  return path.is_object() && path.contains("y_m") && path.contains("z_m") && are_numbers(path["y_m"]) &&
         are_numbers(path["z_m"]) && path["y_m"].size() == path["z_m"].size() && !path["y_m"].empty();
}

/// What the page's script relies on, so that it need not look.
std::string wrong_with(const Json& flight) {
  if (!flight.is_object()) return "is no object";
  for (const char* key : {"tunnel", "scenario", "map", "position"})
    if (!flight.contains(key) || !flight[key].is_string()) return fmt::format("has no text {}", key);
  if (const Json differs = flight.value("extrapolated", Json()); !differs.is_null() && !differs.is_string())
    return "has an extrapolated that is no text";
  for (const char* key : {"walls", "controllers"})
    if (!flight.contains(key) || !flight[key].is_array() || flight[key].empty())
      return fmt::format("has no list {}", key);
  for (const Json& corner : flight["walls"])
    if (!are_numbers(corner) || corner.size() != 2) return "has a wall that is not [y, z]";
  if (!flight.contains("reference") || !is_path(flight["reference"]) ||
      !are_numbers(flight["reference"].value("time_s", Json())) ||
      flight["reference"]["time_s"].size() != flight["reference"]["y_m"].size())
    return "has no reference with time_s, y_m, z_m of one length";
  for (const Json& controller : flight["controllers"]) {
    if (!controller.is_object() || !controller.contains("name") || !controller["name"].is_string())
      return "has a controller without name";
    for (const char* key : {"runs", "contacts", "estimator_rms_mm", "thrust_saturated_s"})
      if (!controller.contains(key) || !controller[key].is_number())
        return fmt::format("has a controller without {}", key);
    for (const char* key : {"rms_y_mm", "rms_z_mm", "max_y_mm", "max_z_mm"})
      if (!controller.contains(key) || !(controller[key].is_number() || has_lost(controller)))
        return fmt::format("has a controller without {}", key);
    for (const char* key : {"rms_of_runs_mm", "contacts_of_runs"})
      if (controller.contains(key) && !are_of_runs(controller[key], controller))
        return fmt::format("has a controller with {} that are not one for each run", key);
    if (!controller.contains("path") || !is_path(controller["path"]) ||
        controller["path"]["y_m"].size() > flight["reference"]["y_m"].size())
      return "has a controller without a path";
  }
  return {};
}

}  // namespace

Json flights_section(const std::string& path) {
  Json document = Json::parse(read_text(path), nullptr, false);
  if (!document.is_object() || document.value("format", Json()) != kFormat ||
      !document.value("flights", Json()).is_array() || document["flights"].empty() ||
      !document.value("command", Json()).is_string())
    throw InputError::in(path, "is no flights.json of `tunnelrig fly --out` (format {})", kFormat);
  for (std::size_t i = 0; i < document["flights"].size(); ++i) {
    if (const std::string wrong = wrong_with(document["flights"][i]); !wrong.empty())
      throw InputError::in(path, "flight {} {}", i + 1, wrong);
  }
  for (Json& flight : document["flights"]) compare_with_best(flight);
  return document;
}

}  // namespace tunnelrig::report
