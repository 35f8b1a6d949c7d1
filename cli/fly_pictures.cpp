#include "cli/fly_pictures.h"

#include "analysis/maps/category_colours.h"
#include "analysis/maps/gnuplot.h"
#include "analysis/maps/staging.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

namespace tunnelrig::cli {
namespace {

/// So many controllers can be told apart in one picture.
constexpr std::size_t kMost = kCategoryColours.size();

std::string style(std::size_t i) { return fmt::format("lc rgb '{}' lw 1.8", kCategoryColours[i % kMost]); }

/// Inline data blocks: walls, vehicle, reference, and one path per controller.
std::string data_blocks(const FlownScenario& flown, const FlightTask& task, std::size_t shown) {
  std::string text = "$walls << EOD\n";
  for (const auto& edge : task.space->walls.edges())
    text += fmt::format("{:.4f} {:.4f}\n", edge.from[0], edge.from[1]);
  const auto& first = task.space->walls.edges()[0].from;
  text += fmt::format("{:.4f} {:.4f}\nEOD\n$vehicle << EOD\n", first[0], first[1]);
  const Plane start = {flown.logs[0].rows[0].position_m[0], flown.logs[0].rows[0].position_m[1]};
  for (const auto& [right, up] : {std::pair(-1, -1), {1, -1}, {1, 1}, {-1, 1}, {-1, -1}})
    text += fmt::format("{:.4f} {:.4f}\n", start[0] + 0.5 * right * task.believed.width_m,
                        start[1] + 0.5 * up * task.believed.height_m);
  text += "EOD\n$reference << EOD\n";
  for (const LogRow& row : flown.logs[0].rows)
    text += fmt::format("{:.4f} {:.4f}\n", row.reference_m[0], row.reference_m[1]);
  text += "EOD\n";
  for (std::size_t i = 0; i < shown; ++i) {
    text += fmt::format("$path{} << EOD\n", i);
    for (const LogRow& row : flown.logs[i].rows)
      text += fmt::format("{:.3f} {:.4f} {:.4f} {:.2f} {:.2f}\n", row.time_s, row.position_m[0],
                          row.position_m[1], 1e3 * (row.reference_m[0] - row.position_m[0]),
                          1e3 * (row.reference_m[1] - row.position_m[1]));
    text += fmt::format("EOD\n$touch{} << EOD\n", i);
    for (const ContactEvent& contact : flown.controllers[i].runs[0].touched)
      text += fmt::format("{:.4f} {:.4f}\n", contact.touched_y_m, contact.touched_z_m);
    text += "EOD\n";
  }
  return text;
}

std::string path_plot(const FlownScenario& flown, std::size_t shown) {
  std::string text =
      "set size ratio -1\nset xlabel 'y [m]'\nset ylabel 'z above the floor [m]'\n"
      "set key outside right top\nset offsets graph 0.03, graph 0.03, graph 0.03, graph 0.03\n"
      "plot $walls with lines lc rgb '#333333' lw 2.5 dt 3 title 'tunnel', "
      "$vehicle with lines lc rgb '#999999' lw 1 title 'vehicle at the start', "
      "$reference with lines lc rgb '#000000' lw 1.2 title 'reference'";
  for (std::size_t i = 0; i < shown; ++i) {
    text += fmt::format(", $path{} using 2:3 with lines {} title '{}'", i, style(i),
                        flown.controllers[i].controller);
    if (!flown.controllers[i].runs[0].touched.empty())
      text += fmt::format(", $touch{} with points pt 2 ps 1.8 {} title '{}: contact'", i, style(i),
                          flown.controllers[i].controller);
  }
  return text + "\n";
}

std::string error_plot(const FlownScenario& flown, std::size_t shown, const char* axis, int column) {
  std::string text = fmt::format(
      "set size noratio\nset autoscale xfix\nset offsets 0, 0, graph 0.05, graph 0.05\nset key outside right "
      "top\n"
      "set xlabel 'time [s]'\nset ylabel 'error in {} (reference − position) [mm]'\nplot 0 lc rgb '#999999' "
      "notitle",
      axis);
  for (std::size_t i = 0; i < shown; ++i)
    text += fmt::format(", $path{} using 1:{} with lines {} title '{}'", i, column, style(i),
                        flown.controllers[i].controller);
  return text + "\n";
}

}  // namespace

std::vector<std::filesystem::path> draw_flown(const std::filesystem::path& folder, const FlownScenario& flown,
                                              const FlightTask& task, std::string& warning) {
  const std::size_t shown = std::min(flown.logs.size(), kMost);
  std::string script = data_blocks(flown, task, shown);
  std::vector<std::string> names;
  const std::string title =
      "set title " +
      gnuplot_text(
          fmt::format("{}, {} tunnel, first run (simulated{}){}", flown.scenario, flown.tunnel,
                      flown.extrapolated.empty() ? "" : ", extrapolated",
                      shown < flown.logs.size() ? fmt::format("; the first {} controllers", shown) : "")) +
      " noenhanced\n";
  const auto add = [&](const char* name, const std::string& plot, int width, int height) {
    for (const char* format : {"svg", "png"}) {
      const bool png = std::string_view(format) == "png";
      names.push_back(fmt::format("{}.{}", name, format));
      script += fmt::format(
          "set terminal {} size {},{}{} font 'DejaVu Sans,{}'\nset output '{}'\n{}{}unset output\n",
          png ? "pngcairo" : "svg", width, height, png ? "" : " background '#ffffff'", png ? 12 : 13,
          names.back(), title, plot);
    }
  };
  script = "set encoding utf8\nset grid lc rgb '#dddddd'\n" + script;
  add(kPictures[0], path_plot(flown, shown), 1000, 820);
  add(kPictures[1], error_plot(flown, shown, "y", 4), 1100, 520);
  add(kPictures[2], error_plot(flown, shown, "z", 5), 1100, 520);
  const Staging staging(folder, "pictures");
  std::optional<std::string> failed;
  staging.write([&] { failed = run_gnuplot("gnuplot", staging.path(), script); });
  if (!failed) return staging.publish(names);
  warning = *failed + "; no pictures";
  return {};
}

}  // namespace tunnelrig::cli
