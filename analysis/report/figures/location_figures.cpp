// C_T and U against height, a curve for each column of the tunnel.
#include "analysis/conventions.h"
#include "analysis/report/figures/tunnel_columns.h"

#include <cmath>

#include <fmt/format.h>

namespace tunnelrig::report {
namespace {

/// Campaigns without places in a tunnel: one point a location, side by side.
std::string side_by_side(const Summary& summary, LocationValue LocationSummary::*value) {
  std::vector<std::vector<double>> rows;
  std::string tics;
  for (const LocationSummary& location : summary.locations) {
    const auto x = static_cast<double>(rows.size());
    tics += fmt::format("{}{} {}", tics.empty() ? "" : ", ", gnuplot_text(location.label), x);
    rows.push_back(with_bar(x, location.*value));
  }
  return data_block("points", rows) +
         fmt::format("set xrange [-0.5:{:.1f}]\nset xtics rotate by 90 right noenhanced ({})\n",
                     static_cast<double>(rows.size()) - 0.5, tics) +
         fmt::format(
             "plot $points using 1:($2-$3):(0):(2*$3) {0} linecolor rgb '{1}' linewidth 0.7, $points using "
             "1:2 "
             "with points linecolor rgb '{1}' pointtype 7 pointsize 0.35\n",
             kBars, category_colour(0));
}

LegendEntry look_of(const std::vector<TunnelColumn>& columns, std::size_t c) {
  return {columns[c].label, ordered_colour(c, columns.size()), point_type(c)};
}

std::string by_height(const std::vector<TunnelColumn>& columns, LocationValue LocationSummary::*value) {
  constexpr double kApart = 0.014;  // between curves, so that bars of one height do not cover each other
  std::string blocks, plot;
  for (std::size_t c = 0; c < columns.size(); ++c) {
    std::vector<std::vector<double>> rows;
    const double shift = kApart * (static_cast<double>(c) - 0.5 * static_cast<double>(columns.size() - 1));
    for (const LocationSummary* location : columns[c].locations)
      rows.push_back(with_bar(*location->z_norm + shift, location->*value));
    const std::string name = fmt::format("column{}", c);
    blocks += data_block(name, rows);
    plot += (c == 0 ? "plot " : ", ") + bar_curve(name, look_of(columns, c));
  }
  return blocks + "set xrange [-1.08:1.08]\nset xtics 0.5\n" + plot + "\n";
}

Figure location_figure(const Material& material, double width_mm, const char* name, const char* axis,
                       LocationValue LocationSummary::*value, const std::string& what) {
  const std::vector<TunnelColumn> columns = tunnel_columns(*material.summary);
  const bool tunnel = !columns.empty();
  constexpr int kAcross = 3;
  const double legend_mm = kLegendRow_mm * std::ceil(static_cast<double>(columns.size()) / kAcross);
  const Sheet sheet{width_mm, 64 + legend_mm};
  const Box box{kPlotLeft_mm, width_mm - kPlotRight_mm, tunnel ? 10.0 : 16.0,
                sheet.height_mm - 3 - legend_mm};
  std::string script = look() + sheet.axes(box, tunnel ? kHeightTitle : "", axis, kLeftTitle_mm);
  std::vector<LegendEntry> entries;
  for (std::size_t c = 0; c < columns.size(); ++c) entries.push_back(look_of(columns, c));
  script += legend(sheet, entries, sheet.height_mm - 2.5, kAcross, kLegendLeft_mm);
  script += tunnel ? by_height(columns, value) : side_by_side(*material.summary, value);
  return {
      name, sheet, script,
      what +
          (tunnel
               ? " against height, a curve for each distance from the tunnel's middle plane; points of one "
                 "height are set apart a little."
               : " by location.") +
          " Bars: U95 of the mean, from the repeats, the sessions and what locations share."};
}

}  // namespace

Figures location_figures(const Material& material, double width_mm) {
  if (!material.summary)
    return {{}, {{"c_t_by_location", material.not_reduced}, {"uneven_by_location", material.not_reduced}}};
  Figures figures;
  figures.drawn.push_back(
      location_figure(material, width_mm, "c_t_by_location", "C_T [–]", &LocationSummary::c_t,
                      fmt::format("Thrust coefficient C_T of all rotors, over ½ρΩ²R² and {},",
                                  area_in_words(material.data.info.rig))));
  if (material.data.info.rig.rotors == kMaxRotors) {
    figures.drawn.push_back(
        location_figure(material, width_mm, "uneven_by_location", "U [%]", &LocationSummary::u_percent,
                        "Uneven thrust U in per cent, right pair of rotors minus left pair over all four,"));
  } else {
    figures.absent.push_back({"uneven_by_location", "uneven thrust compares two pairs of rotors"});
  }
  return figures;
}

}  // namespace tunnelrig::report
