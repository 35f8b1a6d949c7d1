#include "analysis/report/flights_ranking.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

namespace tunnelrig::report {
namespace {

constexpr double kSignificance = 0.05;

double error_mm(const Json& controller) {
  if (has_lost(controller)) return std::numeric_limits<double>::infinity();
  return std::hypot(controller["rms_y_mm"].get<double>(), controller["rms_z_mm"].get<double>());
}

double contacts_of(const Json& controller) { return controller["contacts"].get<double>(); }

using Interval = std::pair<double, double>;

std::optional<Interval> interval_in(const Json& object, const std::string& key) {
  const Json interval = object.value(key, Json());
  if (!interval.is_array() || interval.size() != 2 || !interval[0].is_number() || !interval[1].is_number())
    return {};
  return Interval(interval[0].get<double>(), interval[1].get<double>());
}

std::optional<Interval> interval_mm(const Json& controller) { return interval_in(controller, "ci95_rms_mm"); }

/// Of the mean of what `one` errs more than `other` in the same run, as `fly` computed it; nothing where a
/// flight was lost, of a single run, and in a file of an earlier program.
std::optional<Interval> difference_mm(const Json& one, const Json& other) {
  const Json more = one.value("more_than_mm", Json());
  if (has_lost(one) || has_lost(other) || !more.is_object()) return {};
  return interval_in(more, other["name"].get<std::string>());
}

bool errors_differ(const Json& one, const Json& other) {
  if (const auto difference = difference_mm(one, other))
    return difference->first > 0 || difference->second < 0;
  const auto a = interval_mm(one), b = interval_mm(other);  // of a file that has no differences
  return !a || !b || a->first > b->second || b->first > a->second;
}

struct Touched {
  int runs = 0, all = 0;
};

std::optional<Touched> touched(const Json& controller) {
  const Json runs = controller.value("contacts_of_runs", Json());
  if (!runs.is_array()) return {};
  Touched result{.all = static_cast<int>(runs.size())};
  for (const Json& contacts : runs) result.runs += contacts.is_number() && contacts.get<double>() > 0 ? 1 : 0;
  return result;
}

bool contacts_differ(const Json& one, const Json& other) {
  const auto a = touched(one), b = touched(other);
  if (!a || !b) return contacts_of(one) != contacts_of(other);
  return fisher_two_sided_p(a->runs, a->all, b->runs, b->all) < kSignificance;
}

}  // namespace

bool has_lost(const Json& controller) {
  const Json lost = controller.value("lost", Json());
  return lost.is_number() && lost.get<double>() > 0;
}

double fisher_two_sided_p(int touched, int runs, int other_touched, int other_runs) {
  const int all = touched + other_touched;
  const auto log_choose = [](int n, int k) {
    return std::lgamma(n + 1.0) - std::lgamma(k + 1.0) - std::lgamma(n - k + 1.0);
  };
  const auto probability = [&](int k) {
    return std::exp(log_choose(runs, k) + log_choose(other_runs, all - k) -
                    log_choose(runs + other_runs, all));
  };
  constexpr double kRounding = 1 + 1e-9;
  const double here = probability(touched);
  double p = 0;
  for (int k = std::max(0, all - other_runs); k <= std::min(all, runs); ++k)
    if (probability(k) <= here * kRounding) p += probability(k);
  return std::min(p, 1.0);
}

const Json* best_of(const std::vector<const Json*>& controllers) {
  const Json* fewest = nullptr;
  const auto rank = [](const Json& one) { return std::pair(contacts_of(one), error_mm(one)); };
  for (const Json* one : controllers)
    if (!has_lost(*one) && (fewest == nullptr || rank(*one) < rank(*fewest))) fewest = one;
  const Json* best = fewest;
  for (const Json* one : controllers)
    if (!has_lost(*one) && error_mm(*one) < error_mm(*best) && !contacts_differ(*one, *fewest)) best = one;
  return best;
}

bool not_told_apart(const Json& one, const Json& other) {
  return !has_lost(one) && !has_lost(other) && !contacts_differ(one, other) && !errors_differ(one, other);
}

namespace {

std::vector<const Json*> controllers_of(const Json& flight) {
  std::vector<const Json*> all;
  for (const Json& controller : flight["controllers"]) all.push_back(&controller);
  return all;
}

const Json* controller_in(const Json& flight, const Json& name) {
  for (const Json& controller : flight["controllers"])
    if (controller["name"] == name) return &controller;
  return nullptr;
}

Json best_of_one(const Json& flight) {
  const Json* best = best_of(controllers_of(flight));
  if (best == nullptr) return nullptr;
  Json json{{"scenario", flight["scenario"]},  {"tunnel", flight["tunnel"]}, {"name", (*best)["name"]},
            {"contacts", (*best)["contacts"]}, {"rms_mm", error_mm(*best)},  {"ci95_mm", nullptr},
            {"as_good", Json::array()}};
  if (const auto interval = interval_mm(*best)) json["ci95_mm"] = {interval->first, interval->second};
  for (const Json& controller : flight["controllers"])
    if (&controller != best && not_told_apart(controller, *best))
      json["as_good"].push_back(controller["name"]);
  return json;
}

/// One controller over all scenarios, as an object of one: contacts added, errors joined as a root mean
/// square, runs of contact one after the other. Nothing where it did not come through all of them.
std::optional<Json> joined(const Json& flights, const Json& name) {
  double contacts = 0, squares = 0;
  Json runs = Json::array();
  bool known = true;
  for (const Json& flight : flights) {
    const Json* controller = controller_in(flight, name);
    if (controller == nullptr || has_lost(*controller)) return {};
    contacts += contacts_of(*controller);
    squares += error_mm(*controller) * error_mm(*controller);
    known = known && controller->contains("contacts_of_runs");
    for (const Json& run : controller->value("contacts_of_runs", Json::array())) runs.push_back(run);
  }
  Json all{{"name", name},
           {"contacts", contacts},
           {"rms_y_mm", std::sqrt(squares / static_cast<double>(flights.size()))},
           {"rms_z_mm", 0}};
  if (known) all["contacts_of_runs"] = std::move(runs);
  return all;
}

Json best_of_all(const Json& flights) {
  std::vector<Json> all;
  for (const Json& candidate : flights[0]["controllers"])
    if (auto one = joined(flights, candidate["name"])) all.push_back(std::move(*one));
  std::vector<const Json*> candidates;
  for (const Json& one : all) candidates.push_back(&one);
  const Json* best = best_of(candidates);
  if (best == nullptr) return nullptr;
  int first_in = 0;
  for (const Json& flight : flights) {
    const Json *first = best_of(controllers_of(flight)), *here = controller_in(flight, (*best)["name"]);
    first_in += first == here || not_told_apart(*here, *first) ? 1 : 0;
  }
  return {{"name", (*best)["name"]},
          {"contacts", (*best)["contacts"]},
          {"rms_mm", error_mm(*best)},
          {"first_in", first_in}};
}

}  // namespace

void compare_with_best(Json& flight) {
  flight["best"] = nullptr;
  for (Json& controller : flight["controllers"]) controller.erase("more_than_best_mm");
  const Json* best = best_of(controllers_of(flight));
  if (best == nullptr) return;
  const Json reference = *best;
  flight["best"] = reference["name"];
  for (Json& controller : flight["controllers"]) {
    if (controller["name"] == reference["name"]) continue;
    if (const auto difference = difference_mm(controller, reference))
      controller["more_than_best_mm"] = {difference->first, difference->second};
  }
}

Json best_controller(const Json& section) {
  const Json& flights = section["flights"];
  Json json = flights.size() == 1 ? best_of_one(flights[0]) : best_of_all(flights);
  if (json.is_null()) return json;
  json["scenarios"] = flights.size();
  json["controllers"] = flights[0]["controllers"].size();
  return json;
}

}  // namespace tunnelrig::report
