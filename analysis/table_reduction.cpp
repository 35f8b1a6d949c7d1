#include "analysis/table_reduction.h"

#include "analysis/air.h"
#include "analysis/maps/gnuplot.h"
#include "analysis/maps/staging.h"
#include "analysis/resting_speed.h"
#include "datasets/error.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>

#include <nlohmann/json.hpp>

namespace tunnelrig {
namespace {

/// The rig that a row of a table was measured on, as far as conventions ask: one rotor, one disc.
Rig single_rotor(double diameter_m) {
  Rig rig;
  rig.rotors = 1;
  rig.propeller_radius_m = diameter_m / 2;
  rig.rotor_area_m2 = std::numbers::pi * rig.propeller_radius_m * rig.propeller_radius_m;
  return rig;
}

Convention convention_of_response(const std::string& meaning) {
  if (meaning == "c_t") return Convention::kThesis;
  if (meaning == "c_t_helicopter") return Convention::kHelicopter;
  return Convention::kPropeller;
}

std::optional<double> coefficient(const Observation& row, const std::string& meaning, Convention convention) {
  if (meaning != "thrust_N")
    return convert_coefficient(row.response, convention_of_response(meaning), convention, single_rotor(1));
  if (!row.speed_rpm || *row.speed_rpm <= 0 || !row.diameter_m) return {};
  const double density = dry_air_density_kg_m3(row.air_pressure_Pa, row.air_temperature_C + kZeroCelsius_K);
  if (std::isnan(density)) return {};
  const double propeller = propeller_coefficient(row.response, density, *row.speed_rpm, *row.diameter_m);
  return convert_coefficient(propeller, Convention::kPropeller, convention, single_rotor(*row.diameter_m));
}

double median_of(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2 != 0) return *middle;
  return (*middle + *std::max_element(values.begin(), middle)) / 2;
}

void finish_group(TableReduction& reduction, TableGroup& group) {
  constexpr double kDoubtful = 3;
  const auto speed = [&](std::size_t row) { return reduction.rows[row].speed_rpm; };
  const auto known_end = std::partition(group.rows.begin(), group.rows.end(),
                                        [&](std::size_t row) { return !std::isnan(speed(row)); });
  std::sort(group.rows.begin(), known_end, [&](std::size_t a, std::size_t b) { return speed(a) < speed(b); });
  std::vector<double> c_t;
  for (const std::size_t row : group.rows) c_t.push_back(reduction.rows[row].c_t);
  group.median = median_of(c_t);
  for (const std::size_t row : group.rows) {
    const double ratio = reduction.rows[row].c_t / group.median;
    if (ratio > kDoubtful || ratio < 1 / kDoubtful) reduction.doubtful.push_back(reduction.rows[row].place);
  }
  for (double& value : c_t) value = std::abs(value - group.median);
  group.spread = 1.4826 * median_of(c_t);
  if (known_end == group.rows.begin()) return;
  const TableRow &lowest = reduction.rows[group.rows.front()], &highest = reduction.rows[*(known_end - 1)];
  group.lowest_speed_rpm = lowest.speed_rpm;
  group.highest_speed_rpm = highest.speed_rpm;
  group.at_lowest = lowest.c_t;
  group.at_highest = highest.c_t;
}

/// Many groups get thin lines of one colour and no legend; a handful get a legend, and markers and dashes of
/// their own beside the colours. The axis is of the values: C_T varies by little of itself.
std::string plot_script(const TableReduction& reduction, const std::string& terminal,
                        const std::string& output) {
  constexpr std::size_t kLegendGroups = 8;
  constexpr std::array<int, kLegendGroups> kMarkers = {7, 5, 9, 13, 6, 4, 8, 12};
  const bool legend = reduction.groups.size() <= kLegendGroups;
  std::string script = fmt::format(
      "set terminal {}\nset output {}\nset encoding utf8\nset xlabel 'speed [rev/min]'\n"
      "set ylabel 'C_T ({} convention)'\nset title {} noenhanced\nset grid lc rgb '#dddddd'\n{}\n"
      "set offsets 0, 0, graph 0.05, graph 0.05\nplot ",
      terminal, gnuplot_text(output), name_of(reduction.convention), gnuplot_text(reduction.name),
      legend ? "set key outside right noenhanced" : "unset key");
  std::string data;
  for (std::size_t g = 0; g < reduction.groups.size(); ++g) {
    if (std::isnan(reduction.groups[g].lowest_speed_rpm)) continue;
    script +=
        fmt::format("{}'-' using 1:2 with linespoints {} title {}", data.empty() ? "" : ", ",
                    legend ? fmt::format("lt {} dt {} pt {} ps 0.9 lw 1.5", g + 1, g % 5 + 1, kMarkers[g])
                           : "pt 7 ps 0.4 lw 0.7 lc rgb '#800072b2'",
                    gnuplot_text(reduction.groups[g].name));
    for (const std::size_t row : reduction.groups[g].rows)
      if (!std::isnan(reduction.rows[row].speed_rpm))
        data += fmt::format("{} {}\n", reduction.rows[row].speed_rpm, reduction.rows[row].c_t);
    data += "e\n";
  }
  return script + "\n" + data + "unset output\n";
}

}  // namespace

TableReduction reduce_table_rows(const ObservationTable& table, Convention convention) {
  const std::string& meaning = table.schema.response.meaning;
  if (meaning != "thrust_N" && meaning != "c_t" && meaning != "c_t_helicopter" &&
      meaning != "c_t_propeller") {
    throw InputError::in(table.schema.file,
                         "the response {} is no thrust and no thrust coefficient, so there is no C_T",
                         table.schema.response.column);
  }
  TableReduction reduction{.name = table.schema.name, .convention = convention, .rows = {}, .groups = {}};
  std::map<std::string, std::size_t> groups;
  const std::map<std::string, double> resting = resting_speeds_rpm(table);
  for (std::size_t i = 0; i < table.rows.size(); ++i) {
    const Observation& row = table.rows[i];
    if (row.speed_rpm && *row.speed_rpm <= resting.at(row.group)) {
      ++reduction.at_rest;
      continue;
    }
    const auto c_t = coefficient(row, meaning, convention);
    if (!c_t) {
      ++reduction.unknown;
      continue;
    }
    const auto [found, fresh] = groups.emplace(row.group, reduction.groups.size());
    if (fresh) reduction.groups.push_back({.name = row.group, .rows = {}});
    reduction.groups[found->second].rows.push_back(reduction.rows.size());
    reduction.rows.push_back({i, row.group, row.speed_rpm.value_or(kNotKnown), *c_t, row.place});
  }
  if (reduction.rows.empty()) {
    throw InputError::in(table.schema.file,
                         "no row can be reduced: a speed above 0 and the propeller's diameter are required "
                         "([propeller] in the schema, or --propeller-diameter-m at import)");
  }
  for (TableGroup& group : reduction.groups) finish_group(reduction, group);
  return reduction;
}

std::string observations_csv(const TableReduction& reduction) {
  Sheet sheet{.file = "", .columns = {"group", "row", "speed_rpm", "c_t", "convention"}, .rows = {}};
  for (const TableRow& row : reduction.rows) {
    sheet.rows.push_back(
        {{row.group, row.place, std::isnan(row.speed_rpm) ? "" : fmt::format("{:.6g}", row.speed_rpm),
          fmt::format("{:.8g}", row.c_t), std::string(name_of(reduction.convention))},
         0});
  }
  return format_csv(sheet);
}

std::string table_reduction_json(const TableReduction& reduction) {
  nlohmann::ordered_json json{{"format", "tunnelrig-table-reduction/1"},
                              {"table", reduction.name},
                              {"convention", name_of(reduction.convention)},
                              {"observations", reduction.rows.size()},
                              {"left_out", {{"at_rest", reduction.at_rest}, {"unknown", reduction.unknown}}},
                              {"doubtful_rows", reduction.doubtful}};
  for (const TableGroup& group : reduction.groups) {
    nlohmann::ordered_json one{
        {"group", group.name}, {"c_t_median", group.median}, {"c_t_spread", group.spread}};
    for (const std::size_t row : group.rows)
      one["rows"].push_back({{"speed_rpm", reduction.rows[row].speed_rpm}, {"c_t", reduction.rows[row].c_t}});
    json["groups"].push_back(one);
  }
  return json.dump(1);
}

std::optional<std::string> draw_coefficients(const TableReduction& reduction,
                                             const std::filesystem::path& picture) {
  const std::string extension = picture.extension().string();
  if (extension != ".svg" && extension != ".png") return "write a name that ends in .svg or .png";
  if (std::all_of(reduction.rows.begin(), reduction.rows.end(),
                  [](const TableRow& row) { return std::isnan(row.speed_rpm); }))
    return "no row has a speed that C_T could be drawn against";
  const std::filesystem::path folder =
      picture.has_parent_path() ? picture.parent_path() : std::filesystem::path(".");
  const std::string terminal = extension == ".svg"
                                   ? "svg size 900,540 font 'sans,13' background '#ffffff'"
                                   : "pngcairo size 1350,810 font 'sans,18' background '#ffffff'";
  const std::string name = picture.filename().string();
  const Staging staging(folder, "the picture");
  auto failed = run_gnuplot("gnuplot", staging.path(), plot_script(reduction, terminal, name));
  if (!failed) staging.publish({name});
  return failed;
}

}  // namespace tunnelrig
