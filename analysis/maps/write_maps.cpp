#include "analysis/maps/write_maps.h"

#include "analysis/maps/contours.h"
#include "analysis/maps/gnuplot.h"
#include "analysis/maps/measured_region.h"
#include "analysis/maps/picture.h"
#include "analysis/maps/staging.h"
#include "datasets/csv.h"

#include <cmath>
#include <system_error>

#include <fmt/format.h>

namespace tunnelrig {
namespace {

// Finer than the grid of the files, so that lines are smooth; it holds a column at ȳ = 0, where pictures
// change from the measured to the mirrored half.
constexpr int kDrawingNodes = 121;
constexpr double kHatchingApart = 0.045;
constexpr int kMostLevels = 14, kMostUncertaintyLevels = 5;

std::vector<std::string> pictures_of(const std::string& drawing, bool with_u95) {
  std::vector<std::string> names = {drawing + ".svg", drawing + ".png"};
  if (with_u95) names.insert(names.end(), {drawing + "_u95.svg", drawing + "_u95.png"});
  return names;
}

/// One of the two fields as it is drawn, under the name of its files.
struct Drawing {
  std::string name, symbol, title, colour_label;
  MapLayer layer;  // on the drawing grid
  std::vector<ContourLine> lines;
};

std::string layer_csv(const MapGrid& grid, const MapLayer& layer) {
  std::string text = "y_norm,z_norm,value_percent,u95_percent\n";
  for (std::size_t row = 0; row < grid.z_norm.size(); ++row) {
    for (std::size_t column = 0; column < grid.y_norm.size(); ++column) {
      const std::size_t i = grid.index(row, column);
      const double u95 = layer.u95_percent[i];
      text += fmt::format("{},{},{},{}\n", grid.y_norm[column], grid.z_norm[row], layer.value_percent[i],
                          std::isnan(u95) ? "" : fmt::format("{}", u95));
    }
  }
  return text;
}

std::string contours_csv(const std::vector<ContourLine>& lines) {
  const auto tidy = [](double coordinate) { return std::round(coordinate * 1e6) / 1e6 + 0.0; };  // without −0
  std::string text = "level_percent,line,y_norm,z_norm\n";
  for (std::size_t i = 0; i < lines.size(); ++i) {
    for (const TunnelPoint& point : lines[i].points) {
      text += fmt::format("{},{},{},{}\n", lines[i].level, i + 1, tidy(point.y_norm), tidy(point.z_norm));
    }
  }
  return text;
}

/// Two pictures: the field and, where that is known, its uncertainty.
std::string scripts(const Drawing& drawing, const MapGrid& grid, const TunnelMaps& maps,
                    const FitSummary& fit) {
  const bool process = maps.settings.method == MapMethod::kGaussianProcess;
  Picture picture{
      .title = drawing.title,
      .note = fmt::format("{} locations (×), {}, leave-one-out error {:.2f} %", maps.input.locations.size(),
                          process ? "Gaussian process" : "thin-plate spline", fit.leave_one_out.rms_percent),
      .colour_label = drawing.colour_label,
      .diverging = true,
      .grid = grid,
      .values = drawing.layer.value_percent,
      .lines = drawing.lines,
      .geometry = maps.input.geometry};
  for (const LocationEstimate& location : maps.input.locations) {
    picture.locations.push_back({location.y_norm, location.z_norm});
  }
  picture.hatching = hatching(MeasuredRegion(picture.locations), kHatchingApart);
  std::string script = gnuplot_script(picture, drawing.name);
  if (!drawing.layer.u95_known()) return script;
  picture.title = fmt::format("Uncertainty of {}: half width of the 95 % interval", drawing.symbol);
  picture.colour_label = fmt::format("U_{{95}}({}) (%)", drawing.symbol);
  picture.diverging = false;
  picture.values = drawing.layer.u95_percent;
  picture.lines = contour_plot(grid, picture.values, kMostUncertaintyLevels);
  return script + gnuplot_script(picture, drawing.name + "_u95");
}

/// The new map is in its place by then: an old picture that stays is a reason to warn, not to fail.
void remove_stale(const std::filesystem::path& folder, const std::vector<std::string>& pictures,
                  std::optional<std::string>& warning) {
  for (const std::string& picture : pictures) {
    std::error_code error;
    std::filesystem::remove(folder / picture, error);
    if (!error) continue;
    const std::string left = fmt::format("{} is of another map and cannot be removed: {}",
                                         (folder / picture).string(), error.message());
    warning = warning ? *warning + "; " + left : left;
  }
}

}  // namespace

WrittenMaps write_maps(const std::filesystem::path& folder, const TunnelMaps& maps,
                       const WriteSettings& settings) {
  WrittenMaps written{.map = disturbance_map(maps, settings.nodes, settings.provenance, settings.progress)};
  const DisturbanceMap& map = written.map;
  const MapGrid grid = regular_grid(kDrawingNodes);
  Drawing delta_ct{"delta_ct", "ΔC_T", "Change of thrust coefficient against O_T", "ΔC_T (%)"};
  Drawing uneven{"uneven_thrust", "U", "Uneven thrust, right pair minus left pair",
                 "U (%), negative rolls to the right"};
  delta_ct.layer = sample(maps.delta_ct, grid);
  uneven.layer = sample(maps.uneven_thrust, grid);
  for (Drawing* drawing : {&delta_ct, &uneven}) {
    drawing->lines = contour_plot(grid, drawing->layer.value_percent, kMostLevels);
  }
  const std::vector<std::pair<std::string, std::string>> texts = {
      {"disturbance_map.json", format_disturbance_map(map)},
      {"delta_ct.csv", layer_csv(map.grid, map.delta_ct)},
      {"delta_ct_contours.csv", contours_csv(delta_ct.lines)},
      {"uneven_thrust.csv", layer_csv(map.grid, map.uneven_thrust)},
      {"uneven_thrust_contours.csv", contours_csv(uneven.lines)}};

  const Staging staging(folder, "maps");
  std::vector<std::string> names;
  staging.write([&] {
    for (const auto& [name, text] : texts) {
      write_text(staging.path() / name, text);
      names.push_back(name);
    }
    written.warning = run_gnuplot(
        settings.gnuplot, staging.path(),
        scripts(delta_ct, grid, maps, map.delta_ct_fit) + scripts(uneven, grid, maps, map.uneven_thrust_fit));
  });
  std::vector<std::string> stale;
  for (const Drawing* drawing : {&delta_ct, &uneven}) {
    const bool with_u95 = drawing->layer.u95_known();
    for (const std::string& picture : pictures_of(drawing->name, true)) stale.push_back(picture);
    if (written.warning) continue;
    for (const std::string& picture : pictures_of(drawing->name, with_u95)) {
      names.push_back(picture);
      std::erase(stale, picture);
    }
  }
  written.files = staging.publish(names);
  remove_stale(folder, stale, written.warning);
  return written;
}

}  // namespace tunnelrig
