// The tunnel's middle and outermost column against open space, a ground plane and a ceiling plane: the
// thesis's figures 5.24 and 5.57.
#include "analysis/report/figures/tunnel_columns.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace tunnelrig::report {
namespace {

struct OpenSpace {
  const Material& material;
  Json section;
  bool tunnel = false;
  double low = 0, high = 0;  // of C_T, common to the panels

  const LocationSummary* find(const std::string& label) const {
    for (const LocationSummary& location : material.summary->locations)
      if (location.label == label) return &location;
    return nullptr;
  }

  void hold(const LocationSummary& location) {
    const double half = std::isfinite(location.c_t.u95) ? location.c_t.u95 : 0;
    low = low == 0 ? location.c_t.mean - half : std::min(low, location.c_t.mean - half);
    high = std::max(high, location.c_t.mean + half);
  }
};

std::vector<std::vector<double>> plane_rows(const OpenSpace& space, const char* side) {
  std::vector<std::vector<double>> rows;
  for (const Json& plane : space.section["planes"]) {
    if (plane["side"] != side) continue;
    const double x = space.tunnel ? plane["z_norm"].get<double>() : plane["distance_R"].get<double>();
    rows.push_back(with_bar(x, space.find(plane["location"].get<std::string>())->c_t));
  }
  std::sort(rows.begin(), rows.end());
  return rows;
}

struct Curve {
  LegendEntry look;
  std::string block;  // name of its data
  std::vector<std::vector<double>> rows;
};

/// What a panel shows: a column of the tunnel (none without a tunnel), and the planes.
std::vector<Curve> curves_of(const OpenSpace& space, const TunnelColumn* column) {
  std::vector<Curve> curves;
  if (column != nullptr) {
    curves.push_back({{column->label, "#000000", 7}, "column", {}});
    for (const LocationSummary* location : column->locations)
      curves.back().rows.push_back(with_bar(*location->z_norm, location->c_t));
  }
  curves.push_back({{"GND, ground plane", category_colour(0), 11, 3}, "ground", plane_rows(space, "ground")});
  curves.push_back(
      {{"CEIL, ceiling plane", category_colour(1), 9, 3}, "ceiling", plane_rows(space, "ceiling")});
  std::erase_if(curves, [](const Curve& curve) { return curve.rows.empty(); });
  return curves;
}

constexpr const char* kBandColour = "#cfcfcf";

/// Open space as a band of its U95 from left to right, with its legend.
std::string band(const OpenSpace& space, double left, double right, std::vector<LegendEntry>& entries) {
  if (space.section["open_space"].is_null()) return "";
  const LocationValue& value = space.find(space.section["open_space"].get<std::string>())->c_t;
  const double half = std::isfinite(value.u95) ? value.u95 : 0;
  entries.push_back({"OS, open space", kBandColour, 0, 0});
  return data_block("band", {{left, value.mean - half, value.mean + half, value.mean},
                             {right, value.mean - half, value.mean + half, value.mean}});
}

std::string panel(const OpenSpace& space, const std::vector<Curve>& curves, const Sheet& sheet, double left,
                  double right, double legend_top_mm) {
  std::vector<LegendEntry> entries;
  std::string blocks = band(space, left, right, entries), plot;
  if (!blocks.empty())
    plot = fmt::format(
        "plot $band using 1:2:3 with filledcurves linecolor rgb '{}', $band using 1:4 with lines linecolor "
        "rgb "
        "'#7f7f7f' linewidth 0.5",
        kBandColour);
  for (const Curve& curve : curves) {
    blocks += data_block(curve.block, curve.rows);
    plot += (plot.empty() ? "plot " : ", ") + bar_curve(curve.block, curve.look);
    entries.push_back(curve.look);
  }
  return blocks + legend(sheet, entries, legend_top_mm, 2, kPlotLeft_mm) + plot + "\n";
}

/// The two columns that the thesis shows, H0 and H4; of other grids the middle and the outermost.
std::vector<TunnelColumn> shown_columns(const Summary& summary) {
  std::vector<TunnelColumn> columns = tunnel_columns(summary);
  if (columns.size() < 2) return columns;
  auto outer = std::find_if(columns.begin(), columns.end(),
                            [](const TunnelColumn& column) { return column.label.starts_with("H4,"); });
  if (outer == columns.end() || outer == columns.begin()) outer = columns.end() - 1;
  return {columns.front(), *outer};
}

/// The range of C_T of everything that is shown.
void hold_all(const std::vector<TunnelColumn>& columns, OpenSpace& space) {
  for (const TunnelColumn& column : columns)
    for (const LocationSummary* location : column.locations) space.hold(*location);
  for (const Json& plane : space.section["planes"])
    space.hold(*space.find(plane["location"].get<std::string>()));
  if (!space.section["open_space"].is_null())
    space.hold(*space.find(space.section["open_space"].get<std::string>()));
}

/// The reach of the horizontal axis: heights in the tunnel, or distances from the plane.
std::pair<double, double> reach(const OpenSpace& space) {
  if (space.tunnel) return {-1.15, 1.15};
  double furthest_R = 0;
  for (const Json& plane : space.section["planes"])
    furthest_R = std::max(furthest_R, plane["distance_R"].get<double>());
  return {0, furthest_R > 0 ? 1.1 * furthest_R : 1};
}

std::string caption_of(const OpenSpace& space) {
  if (!space.tunnel)
    return "C_T in open space (grey band: C_T at OS with its U95), above a ground plane (GND) and beneath a "
           "ceiling plane (CEIL), by the distance of the rotors from the plane. Bars: U95.";
  return "C_T in the tunnel against open space (grey band: C_T at OS with its U95), above a ground plane "
         "(GND) and beneath a ceiling plane (CEIL). A point at distance d from a plane stands at the height "
         "in the tunnel that is as far from its floor or ceiling. Bars: U95.";
}

}  // namespace

Figures open_space_figures(const Material& material, double width_mm) {
  Json section = open_space_section(material);
  if (section.contains("absent")) return {{}, {{"open_space", section["absent"].get<std::string>()}}};
  OpenSpace space{.material = material, .section = std::move(section)};
  std::vector<TunnelColumn> columns = shown_columns(*material.summary);
  space.tunnel = space.section["tunnel"].get<bool>() && !columns.empty();
  if (!space.tunnel) columns.clear();
  hold_all(columns, space);

  const std::size_t panels = std::max<std::size_t>(columns.size(), 1);
  constexpr double kPanel_mm = 40, kKey_mm = 8.5, kBelow_mm = 10;
  const Sheet sheet{width_mm, static_cast<double>(panels) * (kPanel_mm + kKey_mm) + kBelow_mm};
  const auto [left, right] = reach(space);
  const double room = 0.06 * (space.high - space.low);
  std::string script = look() + "set multiplot\n";
  script += fmt::format("set yrange [{:.6g}:{:.6g}]\nset xrange [{:g}:{:g}]\n", space.low - room,
                        space.high + room, left, right);
  if (space.tunnel) script += "set xtics 0.5\n";
  for (std::size_t i = 0; i < panels; ++i) {
    const bool last = i + 1 == panels;
    const double top = sheet.height_mm - static_cast<double>(i) * (kPanel_mm + kKey_mm) - kKey_mm;
    const char* below = space.tunnel ? kHeightTitle : "distance of the rotors from the plane [R]";
    script += kNextPanel + sheet.axes({kPlotLeft_mm, width_mm - kPlotRight_mm, top - kPanel_mm, top},
                                      last ? below : "", "C_T [–]", kLeftTitle_mm);
    script += fmt::format("set format x '{}'\n", last ? "%g" : "");
    const std::vector<Curve> curves = curves_of(space, columns.empty() ? nullptr : &columns[i]);
    script += panel(space, curves, sheet, left, right, top + kKey_mm - 2.2);
  }
  script += "unset multiplot\n";
  return {{{"open_space", sheet, script, caption_of(space)}}, {}};
}

}  // namespace tunnelrig::report
