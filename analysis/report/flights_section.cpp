#include "analysis/report/sections.h"
#include "datasets/csv.h"
#include "datasets/error.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <tuple>
#include <utility>

namespace tunnelrig::report {
namespace {

constexpr const char* kFormat = "tunnelrig-flights/1";

bool are_numbers(const Json& values) {
  return values.is_array() &&
         std::all_of(values.begin(), values.end(), [](const Json& v) { return v.is_number(); });
}

bool is_path(const Json& path) {
  return path.is_object() && path.contains("y_m") && path.contains("z_m") && are_numbers(path["y_m"]) &&
         are_numbers(path["z_m"]) && path["y_m"].size() == path["z_m"].size() && !path["y_m"].empty();
}

/// Its errors are null then.
bool has_lost(const Json& controller) {
  const Json lost = controller.value("lost", Json());
  return lost.is_number() && lost.get<double>() > 0;
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
    if (!controller.contains("path") || !is_path(controller["path"]) ||
        controller["path"]["y_m"].size() > flight["reference"]["y_m"].size())
      return "has a controller without a path";
  }
  return {};
}

}  // namespace

namespace {

double error_mm(const Json& controller) {
  if (has_lost(controller)) return std::numeric_limits<double>::infinity();
  return std::hypot(controller["rms_y_mm"].get<double>(), controller["rms_z_mm"].get<double>());
}

/// A flight that was lost is worst, fewer contacts are better, then smaller errors.
std::tuple<bool, double, double> flight_rank(const Json& controller) {
  return {has_lost(controller), controller["contacts"].get<double>(), error_mm(controller)};
}

std::optional<std::pair<double, double>> interval_mm(const Json& controller) {
  const Json interval = controller.value("ci95_rms_mm", Json());
  if (!are_numbers(interval) || interval.size() != 2) return {};
  return std::pair(interval[0].get<double>(), interval[1].get<double>());
}

/// Whether the runs cannot tell a controller from the best one: as many contacts, and intervals that overlap.
bool as_good(const Json& controller, const Json& best) {
  const auto one = interval_mm(controller), other = interval_mm(best);
  return controller["name"] != best["name"] && controller["contacts"] == best["contacts"] && one && other &&
         one->first <= other->second;
}

const Json& best_of(const Json& flight) {
  const Json& all = flight["controllers"];
  return *std::min_element(all.begin(), all.end(),
                           [](const Json& a, const Json& b) { return flight_rank(a) < flight_rank(b); });
}

const Json* controller_in(const Json& flight, const Json& name) {
  for (const Json& controller : flight["controllers"])
    if (controller["name"] == name) return &controller;
  return nullptr;
}

Json best_of_one(const Json& flight) {
  const Json& best = best_of(flight);
  if (has_lost(best)) return nullptr;
  const auto interval = interval_mm(best);
  Json json{{"scenario", flight["scenario"]}, {"tunnel", flight["tunnel"]}, {"name", best["name"]},
            {"contacts", best["contacts"]},   {"rms_mm", error_mm(best)},   {"ci95_mm", nullptr},
            {"as_good", Json::array()}};
  if (interval) json["ci95_mm"] = {interval->first, interval->second};
  for (const Json& controller : flight["controllers"])
    if (as_good(controller, best)) json["as_good"].push_back(controller["name"]);
  return json;
}

/// Over all scenarios: the sum of the contacts, then the root mean square of the errors.
Json best_of_all(const Json& flights) {
  Json best;
  std::pair<double, double> best_rank;
  for (const Json& candidate : flights[0]["controllers"]) {
    double contacts = 0, squares = 0;
    int flown = 0, first_in = 0;
    for (const Json& flight : flights) {
      const Json* controller = controller_in(flight, candidate["name"]);
      if (controller == nullptr || has_lost(*controller)) break;
      ++flown;
      contacts += (*controller)["contacts"].get<double>();
      squares += error_mm(*controller) * error_mm(*controller);
      const Json& first = best_of(flight);
      first_in += first["name"] == candidate["name"] || as_good(*controller, first) ? 1 : 0;
    }
    if (flown < static_cast<int>(flights.size())) continue;
    const std::pair here(contacts, std::sqrt(squares / flown));
    if (!best.is_null() && !(here < best_rank)) continue;
    best_rank = here;
    best = {
        {"name", candidate["name"]}, {"contacts", contacts}, {"rms_mm", here.second}, {"first_in", first_in}};
  }
  return best;
}

}  // namespace

Json best_controller(const Json& section) {
  const Json& flights = section["flights"];
  Json json = flights.size() == 1 ? best_of_one(flights[0]) : best_of_all(flights);
  if (json.is_null()) return json;
  json["scenarios"] = flights.size();
  json["controllers"] = flights[0]["controllers"].size();
  return json;
}

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
  return document;
}

}  // namespace tunnelrig::report
