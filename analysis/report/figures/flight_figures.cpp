// What `tunnelrig fly` flew: paths and errors of the first run, and the error over all runs.
#include "analysis/report/figures/figures.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace tunnelrig::report {
namespace {

constexpr std::size_t kMostPaths = 4;  // that can be told apart at the width of a column

std::vector<std::vector<double>> path_rows(const Json& reference, const Json& path) {
  std::vector<std::vector<double>> rows;
  for (std::size_t i = 0; i < path["y_m"].size(); ++i) {
    const double y = path["y_m"][i].get<double>(), z = path["z_m"][i].get<double>();
    rows.push_back({reference["time_s"][i].get<double>(), y, z, 1e3 * (reference["y_m"][i].get<double>() - y),
                    1e3 * (reference["z_m"][i].get<double>() - z)});
  }
  return rows;
}

std::string blocks_of(const Json& flight, std::size_t shown) {
  std::vector<std::vector<double>> walls;
  for (const Json& corner : flight["walls"])
    walls.push_back({corner[0].get<double>(), corner[1].get<double>()});
  walls.push_back(walls.front());
  std::string text = data_block("walls", walls) +
                     data_block("reference", path_rows(flight["reference"], flight["reference"]));
  for (std::size_t i = 0; i < shown; ++i)
    text += data_block(fmt::format("path{}", i),
                       path_rows(flight["reference"], flight["controllers"][i]["path"]));
  return text;
}

LegendEntry look_of_controller(const Json& flight, std::size_t i) {
  return {flight["controllers"][i]["name"].get<std::string>(), category_colour(i), 0, static_cast<int>(i) + 1,
          0.9};
}

std::string curves(const Json& flight, std::size_t shown, const char* columns) {
  std::string text;
  for (std::size_t i = 0; i < shown; ++i) {
    const LegendEntry look = look_of_controller(flight, i);
    text += fmt::format(", $path{} using {} with lines linecolor rgb '{}' linewidth {} dashtype {}", i,
                        columns, look.colour, look.line_width, look.dash);
  }
  return text + "\n";
}

/// Between the labels of an axis in metres, so that each has 11 mm: 1, 2 or 5 times a power of ten.
double tic_step_m(const Json& walls, double plot_mm) {
  constexpr double kLabel_mm = 11;
  double low_m = 0, high_m = 0;
  for (const Json& corner : walls) {
    low_m = std::min(low_m, corner[0].get<double>());
    high_m = std::max(high_m, corner[0].get<double>());
  }
  if (!(high_m > low_m)) return 1;
  const double least_m = (high_m - low_m) * kLabel_mm / plot_mm;
  const double decade_m = std::pow(10, std::floor(std::log10(least_m)));
  for (const double step : {1., 2., 5.})
    if (step * decade_m >= least_m) return step * decade_m;
  return 10 * decade_m;
}

/// For a caption: in a tunnel, or with a vehicle, that is not the map's.
std::string extrapolation_note(const Json& flight) {
  const Json differs = flight.value("extrapolated", Json());
  return differs.is_string() ? fmt::format(" Extrapolated: {}.", differs.get<std::string>()) : "";
}

Figure paths_figure(const Json& flight, const std::string& name, double width_mm) {
  const std::size_t shown = std::min(flight["controllers"].size(), kMostPaths);
  constexpr double kLeft_mm = 15, kRight_mm = 2, kStrip_mm = 22, kLabel_mm = 10, kGap_mm = 2.5,
                   kTitle_mm = 12;
  const int across = width_mm < 75 ? 2 : 3;  // names have as many letters in a narrow figure
  const double key_mm = across == 3 ? 8.5 : 12;
  const double path_mm = std::min(0.72 * width_mm, 110.0);
  const Sheet sheet{width_mm, key_mm + path_mm + kLabel_mm + 2 * kStrip_mm + kGap_mm + kLabel_mm};
  double top = sheet.height_mm - key_mm;
  std::string script = look() + blocks_of(flight, shown) + "set multiplot\n";
  script += sheet.axes({kLeft_mm, width_mm - kRight_mm, top - path_mm, top}, "y [m]", "z above the floor [m]",
                       kTitle_mm);
  std::vector<LegendEntry> entries{{"tunnel", "#333333", 0, 1, 1.6}, {"reference", "#000000", 0, 1, 0.5}};
  for (std::size_t i = 0; i < shown; ++i) entries.push_back(look_of_controller(flight, i));
  script += legend(sheet, entries, sheet.height_mm - 2.2, across, kLeft_mm);
  const double step_m = tic_step_m(flight["walls"], std::min(path_mm, width_mm - kLeft_mm - kRight_mm));
  script += fmt::format("set xtics {0:g}\nset ytics {0:g}\n", step_m);
  script +=
      "set xrange [*:*] noextend\nset yrange [*:*] noextend\nset size ratio -1\nset offsets graph 0.03, "
      "graph 0.03, graph 0.03, graph "
      "0.03\n"
      "plot $walls with lines linecolor rgb '#333333' linewidth 1.6, $reference using 2:3 with lines "
      "linecolor "
      "rgb '#000000' linewidth 0.5" +
      curves(flight, shown, "2:3");
  top -= path_mm + kLabel_mm;
  script +=
      "set xtics autofreq\nset ytics autofreq\nset xrange [*:*] extend\nset yrange [*:*] extend\nset size "
      "noratio\nset offsets 0, 0, "
      "graph 0.05, graph "
      "0.05\nset autoscale xfix\n";
  for (const auto& [axis, columns, last] : {std::tuple{"y", "1:4", false}, std::tuple{"z", "1:5", true}}) {
    script +=
        kNextPanel + sheet.axes({kLeft_mm, width_mm - kRight_mm, top - kStrip_mm, top},
                                last ? "time [s]" : "", fmt::format("error in {} [mm]", axis), kTitle_mm);
    script +=
        fmt::format("set format x '{}'\nplot 0 linecolor rgb '#999999' linewidth 0.4", last ? "%g" : "") +
        curves(flight, shown, columns);
    top -= kStrip_mm + kGap_mm;
  }
  const std::string others =
      shown < flight["controllers"].size()
          ? fmt::format(" The first {} of {} controllers.", shown, flight["controllers"].size())
          : "";
  return {name, sheet, script + "unset multiplot\n",
          fmt::format("Simulated: {} in the {} tunnel, the first run of each controller; path in the "
                      "cross-section in metres, and reference less position over time in millimetres. Single "
                      "runs have no bars; those of all runs are in the figure of errors.{}{}",
                      flight["scenario"].get<std::string>(), flight["tunnel"].get<std::string>(), others,
                      extrapolation_note(flight))};
}

/// Mean error of each controller over its runs; crosses where one touched a wall.
Figure errors_figure(const Json& flight, const std::string& name, double width_mm) {
  std::vector<std::vector<double>> clean, touched;
  std::string tics;
  const Json& controllers = flight["controllers"];
  for (std::size_t i = 0; i < controllers.size(); ++i) {
    const Json& one = controllers[i];
    const double y = static_cast<double>(controllers.size() - 1 - i);
    const bool lost = one["rms_y_mm"].is_null();  // a flight: no error, and no point
    const double rms = lost ? NAN : std::hypot(one["rms_y_mm"].get<double>(), one["rms_z_mm"].get<double>());
    const Json interval = one.value("ci95_rms_mm", Json());
    const bool known =
        interval.is_array() && interval.size() == 2 && interval[0].is_number() && interval[1].is_number();
    const double low = known ? interval[0].get<double>() : NAN,
                 high = known ? interval[1].get<double>() : NAN;
    auto& rows = one["contacts"].get<double>() > 0 ? touched : clean;
    // The mean is in the interval's middle, except where that ends at 0.
    const double mean = known && low > 0 ? 0.5 * (low + high) : rms;
    if (!lost) rows.push_back({mean, y, known ? low : rms, known ? high : rms});
    tics += fmt::format("{}{} {}", i == 0 ? "" : ", ",
                        gnuplot_text(one["name"].get<std::string>() + (lost ? " (lost)" : "")), y);
  }
  constexpr double kLeft_mm = 24, kRow_mm = 4.2;
  const double plot_mm = kRow_mm * (static_cast<double>(controllers.size()) + 0.4);
  const Sheet sheet{width_mm, plot_mm + 15};
  std::string script = look() + sheet.axes({kLeft_mm, width_mm - 3, 10, 10 + plot_mm},
                                           "mean over the runs of the rms error [mm]", "");
  script += fmt::format("set xrange [0:*]\nset yrange [-0.7:{:.1f}]\nset ytics noenhanced ({})\n",
                        static_cast<double>(controllers.size()) - 0.3, tics);
  std::string plot;
  std::vector<LegendEntry> entries;
  const auto add = [&](const char* block, const auto& rows, const LegendEntry& entry) {
    if (rows.empty()) return;
    script += data_block(block, rows);
    plot += fmt::format(
        "{0} ${1} using 3:2:($4-$3):(0) {2} linecolor rgb '{3}' linewidth 0.8, ${1} using 1:2 with points "
        "linecolor "
        "rgb '{3}' linewidth 0.8 pointtype {4} pointsize 0.4",
        plot.empty() ? "plot" : ",", block, kBars, entry.colour, entry.point);
    entries.push_back(entry);
  };
  add("clean", clean, {"no contact", category_colour(0), 7});
  add("touched", touched, {"touched a wall", category_colour(1), 2});
  if (plot.empty()) plot = "set xrange [0:1]\nplot NaN";  // every controller lost a flight
  script += legend(sheet, entries, sheet.height_mm - 2.2, 2, kLeft_mm);
  return {
      name, sheet, script + plot + "\n",
      fmt::format(
          "Simulated: {} in the {} tunnel, {} runs of each controller. Root mean square error in y and z "
          "together, mean over the runs; bars: its 95 % interval (Student's t). Crosses: a controller that "
          "touched a wall in at least one run.{}",
          flight["scenario"].get<std::string>(), flight["tunnel"].get<std::string>(),
          controllers[0]["runs"].get<double>(), extrapolation_note(flight))};
}

}  // namespace

Figures flight_figures(const Json& flights, double width_mm) {
  Figures figures;
  for (std::size_t i = 0; i < flights["flights"].size(); ++i) {
    const Json& flight = flights["flights"][i];
    figures.drawn.push_back(paths_figure(flight, fmt::format("flight_{}_paths", i + 1), width_mm));
    figures.drawn.push_back(errors_figure(flight, fmt::format("flight_{}_errors", i + 1), width_mm));
  }
  return figures;
}

}  // namespace tunnelrig::report
