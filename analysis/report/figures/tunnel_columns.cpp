#include "analysis/report/figures/tunnel_columns.h"

#include "datasets/locations.h"

#include <algorithm>
#include <cmath>
#include <map>

#include <fmt/format.h>

namespace tunnelrig::report {
namespace {

/// "H3" where all locations are the thesis's of that column; empty otherwise.
std::string thesis_name(const std::vector<const LocationSummary*>& locations) {
  std::string name;
  for (const LocationSummary* location : locations) {
    const std::string label = location->label == "OT" ? "H0V0" : location->label;
    const std::string here = label.substr(0, label.find('V'));
    if (!grid_point(location->label) || (!name.empty() && here != name)) return {};
    name = here;
  }
  return name;
}

}  // namespace

std::vector<TunnelColumn> tunnel_columns(const Summary& summary) {
  std::map<std::pair<double, double>, TunnelColumn> by_place;
  for (const LocationSummary& location : summary.locations) {
    if (!location.y_norm) continue;
    const double y = std::round(*location.y_norm * 1e3) / 1e3;
    TunnelColumn& column = by_place[{std::abs(y), y}];
    column.y_norm = y;
    column.locations.push_back(&location);
  }
  std::vector<TunnelColumn> columns;
  for (auto& [place, column] : by_place) {
    std::sort(column.locations.begin(), column.locations.end(),
              [](const auto* a, const auto* b) { return *a->z_norm < *b->z_norm; });
    const std::string name = thesis_name(column.locations);
    column.label = fmt::format("{}ȳ = {:.2f}", name.empty() ? "" : name + ", ", column.y_norm);
    columns.push_back(std::move(column));
  }
  return columns;
}

std::vector<double> with_bar(double x, const LocationValue& value) {
  return {x, value.mean, std::isfinite(value.u95) ? value.u95 : 0};
}

std::string bar_curve(const std::string& block, const LegendEntry& look) {
  const std::string line = fmt::format("linecolor rgb '{}' linewidth {}", look.colour, look.line_width);
  return fmt::format(
      "${0} using 1:2 with lines {1} dashtype {2}, ${0} using 1:($2-$3):(0):(2*$3) {3} {1}, "
      "${0} using 1:2 with points {1} pointtype {4} pointsize {5}",
      block, line, look.dash, kBars, look.point, point_size(look.point));
}

}  // namespace tunnelrig::report
