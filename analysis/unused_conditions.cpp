#include "analysis/unused_conditions.h"

#include "analysis/air.h"
#include "datasets/locations.h"
#include "datasets/thesis.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <optional>

#include <fmt/format.h>

namespace tunnelrig {
namespace {

constexpr const char* kPressure = "air_pressure";  // far from the model's in most places, and so always named

/// C_T with the condition as recorded over C_T without it; nothing where it was not recorded.
using Ratio = std::function<std::optional<double>(const Run&)>;

std::optional<double> by_pressure(const Run& run) {
  const auto recorded_Pa = run.number("air_pressure_Pa");
  return recorded_Pa && *recorded_Pa > 0 ? std::optional(thesis::kPressure_Pa / *recorded_Pa) : std::nullopt;
}

std::optional<double> by_humidity(const Run& run) {
  const auto humidity = run.number("relative_humidity");
  const auto celsius = run.number("air_temperature_C");
  if (!humidity || !celsius) return std::nullopt;
  const double temperature_K = *celsius + kZeroCelsius_K;
  return dry_air_density_kg_m3(thesis::kPressure_Pa, temperature_K) /
         moist_air_density_kg_m3(thesis::kPressure_Pa, temperature_K, *humidity);
}

void compare(const CampaignData& data, const std::vector<std::size_t>& runs, const char* column,
             const Ratio& ratio, UnusedCondition& condition) {
  std::map<std::string, std::pair<double, double>> by_location;  // sum of per cents, number
  double percents = 0;
  for (const std::size_t r : runs) {
    const Run& run = data.runs[r];
    const auto here = ratio(run);
    if (!here) continue;
    const double percent = 100 * (*here - 1);
    condition.recorded += 1;
    percents += percent;
    condition.mean += run.number(column).value_or(0);
    auto& [sum, number] = by_location[canonical_location(run.location)];
    sum += percent;
    number += 1;
  }
  condition.runs = runs.size();
  if (condition.recorded == 0) return;
  condition.mean /= static_cast<double>(condition.recorded);
  condition.c_t_percent = percents / static_cast<double>(condition.recorded);
  double furthest = -1;
  for (const auto& [location, sums] : by_location) {
    const double percent = sums.first / sums.second, by = std::abs(percent - condition.c_t_percent);
    if (by <= furthest) continue;
    furthest = by;
    condition.furthest = location;
    condition.furthest_c_t_percent = percent;
  }
}

constexpr double kRounded_percent = 0.005;  // of C_T: less is printed as nothing

/// By how much of C_T, in per cent, a location must differ to be worth a word.
double apart_percent(double u95_percent) {
  return std::isfinite(u95_percent) ? u95_percent : kRounded_percent;
}

std::string sentence(const UnusedCondition& condition, double u95_percent) {
  if (condition.recorded == 0)
    return fmt::format("{}: {}, and not recorded; {}", condition.quantity, condition.taken_for,
                       condition.if_unrecorded);
  std::string text = fmt::format("{}: {}; as recorded{} ({} on average) it makes C_T {} than it stands here",
                                 condition.quantity, condition.taken_for,
                                 condition.recorded < condition.runs
                                     ? fmt::format(" in {} of {} runs", condition.recorded, condition.runs)
                                     : "",
                                 condition.mean_text, UnusedCondition::change(condition.c_t_percent));
  if (std::abs(condition.furthest_c_t_percent - condition.c_t_percent) > apart_percent(u95_percent))
    text += fmt::format(", that of {} {}", condition.furthest,
                        UnusedCondition::change(condition.furthest_c_t_percent));
  if (std::isfinite(u95_percent)) text += fmt::format(", where U95 is {:.2f} %", u95_percent);
  return text + fmt::format(" (`reduce --with {}` takes it in)", condition.term);
}

/// Of a speed that was kept there is nothing to say.
bool says_something(const UnusedCondition& condition, double u95_percent) {
  return condition.recorded < condition.runs || std::abs(condition.c_t_percent) >= kRounded_percent ||
         std::abs(condition.furthest_c_t_percent - condition.c_t_percent) > apart_percent(u95_percent);
}

bool adopted(const AppliedModel& model, const std::string& effect) {
  return std::ranges::find(model.effect_names, effect) != model.effect_names.end();
}

}  // namespace

std::string UnusedCondition::change(double percent) {
  return fmt::format("{:.2f} % {}", std::abs(percent), percent < 0 ? "less" : "greater");
}

std::vector<UnusedCondition> unused_conditions(const CampaignData& data, const std::vector<std::size_t>& runs,
                                               const ModelTerms& terms, const AppliedModel& model) {
  const double nominal_rpm = data.info.rig.nominal_speed_rpm;
  const auto by_speed = [nominal_rpm](const Run& run) -> std::optional<double> {
    const auto recorded_rpm = run.number("speed_rpm");
    if (!recorded_rpm || *recorded_rpm <= 0) return std::nullopt;
    return std::pow(nominal_rpm / *recorded_rpm, 2);
  };
  std::vector<UnusedCondition> unused;
  const auto add = [&](bool enters, UnusedCondition condition, const char* column, const Ratio& ratio) {
    if (enters || adopted(model, condition.term)) return;
    compare(data, runs, column, ratio, condition);
    condition.mean_text = condition.term == "air_humidity" ? fmt::format("{:.0f} %", 100 * condition.mean)
                          : condition.term == kPressure    ? fmt::format("{:.0f} Pa", condition.mean)
                                                           : fmt::format("{:.0f} rev/min", condition.mean);
    unused.push_back(std::move(condition));
  };
  add(terms.air_pressure,
      {.quantity = "pressure",
       .taken_for = fmt::format("taken for {:.0f} Pa", thesis::kPressure_Pa),
       .if_unrecorded = "C_T is off by as many per cent as the pressure was, which weather makes 1 % and "
                        "500 m of height 6 %",
       .term = kPressure},
      "air_pressure_Pa", by_pressure);
  add(terms.air_humidity,
      {.quantity = "humidity",
       .taken_for = "the air is taken for dry",
       .if_unrecorded = "at 20 °C and 60 % that makes C_T 0.5 % less",
       .term = "air_humidity"},
      "relative_humidity", by_humidity);
  add(terms.rotor_speed,
      {.quantity = "speed",
       .taken_for = fmt::format("taken for nominal ({:.0f} rev/min)", nominal_rpm),
       .if_unrecorded = "C_T is off by twice as many per cent as the speed was",
       .term = "rotor_speed"},
      "speed_rpm", by_speed);
  return unused;
}

std::vector<std::string> notes_of_unused_conditions(const CampaignData& data, const Reduction& reduction,
                                                    double u95_percent) {
  std::vector<std::size_t> runs;
  for (const RunCoefficients& run : reduction.runs) runs.push_back(run.run);
  std::vector<std::string> notes;
  for (const UnusedCondition& condition : unused_conditions(data, runs, reduction.terms, reduction.model))
    if (condition.term == kPressure || says_something(condition, u95_percent))
      notes.push_back(sentence(condition, u95_percent));
  return notes;
}

}  // namespace tunnelrig
