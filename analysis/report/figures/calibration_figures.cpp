#include "analysis/report/figures/figures.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace tunnelrig::report {
namespace {

/// Forces and residuals that all panels hold.
struct CommonAxes {
  double low_N = 0, high_N = 0, reach_mN = 0;
};

CommonAxes common_axes(const Certificate& certificate) {
  CommonAxes axes{.low_N = 1e300, .high_N = -1e300};
  for (const CellFit& cell : certificate.cells) {
    axes.reach_mN = std::max(axes.reach_mN, 2.2e3 * cell.residual_std_N());
    for (const CellPoint& point : cell.points) {
      axes.low_N = std::min(axes.low_N, point.force_N);
      axes.high_N = std::max(axes.high_N, point.force_N);
      axes.reach_mN = std::max(axes.reach_mN, 1.1e3 * std::abs(point.residual_N));
    }
  }
  const double room = 0.06 * (axes.high_N - axes.low_N);
  return {axes.low_N - room, axes.high_N + room, axes.reach_mN};
}

std::string panel_of_cell(const CellFit& cell, const CommonAxes& axes) {
  std::vector<std::vector<double>> used, suspicious, out;
  for (const CellPoint& point : cell.points) {
    auto& rows = point.weight == 0 ? out : point.suspicious ? suspicious : used;
    rows.push_back({point.force_N, 1e3 * point.residual_N});
  }
  const double two_mN = 2e3 * cell.residual_std_N();
  std::string blocks = data_block("band", {{axes.low_N, -two_mN, two_mN}, {axes.high_N, -two_mN, two_mN}});
  std::string plot = "plot $band using 1:2:3 with filledcurves linecolor rgb '#dfe7ee'";
  const auto add = [&](const char* name, const auto& rows, int type, double size, const std::string& colour) {
    if (rows.empty()) return;
    blocks += data_block(name, rows);
    plot += fmt::format(", ${} using 1:2 with points pointtype {} pointsize {} linecolor rgb '{}'", name,
                        type, size, colour);
  };
  add("used", used, 7, 0.3, category_colour(0));
  add("suspicious", suspicious, 12, 0.6, category_colour(1));
  add("out", out, 2, 0.5, category_colour(1));
  return blocks + plot + "\n";
}

}  // namespace

Figures calibration_figures(const Material& material, double width_mm) {
  const Json section = calibration_section(material);
  if (section.contains("absent"))
    return {{}, {{"calibration_residuals", section["absent"].get<std::string>()}}};
  const Certificate& certificate = *material.data.certificate;
  const CommonAxes axes = common_axes(certificate);
  constexpr double kLeft_mm = 13, kGap_mm = 2.5, kBottom_mm = 10, kRow_mm = 27, kTop_mm = 1.5;
  const std::size_t cells = certificate.cells.size(), across = cells > 1 ? 2 : 1,
                    rows = (cells + across - 1) / across;
  const Sheet sheet{width_mm,
                    kBottom_mm + kTop_mm + static_cast<double>(rows) * (kRow_mm + kGap_mm) - kGap_mm};
  const double column_mm =
      (width_mm - kLeft_mm - kGap_mm * static_cast<double>(across)) / static_cast<double>(across);
  std::string script = look() + "set multiplot\n";
  script += fmt::format("set xrange [{:.6g}:{:.6g}]\nset yrange [{:.6g}:{:.6g}]\n", axes.low_N, axes.high_N,
                        -axes.reach_mN, axes.reach_mN);
  for (std::size_t i = 0; i < cells; ++i) {
    const bool leftmost = i % across == 0, lowest = i + across >= cells;
    const std::size_t row = i / across;
    const double left = kLeft_mm + static_cast<double>(i % across) * (column_mm + kGap_mm);
    const double top = sheet.height_mm - kTop_mm - static_cast<double>(row) * (kRow_mm + kGap_mm);
    script +=
        kNextPanel + sheet.axes({left, left + column_mm, top - kRow_mm, top},
                                lowest ? "applied force [N]" : "", leftmost ? "residual [mN]" : "", 10.5);
    script += fmt::format("set format x '{}'\nset format y '{}'\n", lowest ? "%g" : "", leftmost ? "%g" : "");
    script += fmt::format("set label 1 'cell {}' at graph 0.04,0.9 font ',{}' front\n",
                          certificate.cells[i].cell, kSmallFont_pt);
    script += panel_of_cell(certificate.cells[i], axes);
  }
  script += "unset multiplot\n";
  return {{{"calibration_residuals", sheet, script,
            "Residuals of the load cells' calibration in mN against the applied force: how much more force "
            "the fitted "
            "line gives than was applied, point by point. Band: twice the standard deviation of the "
            "residuals. Open "
            "diamonds: points that stick out; crosses: gross errors, left out."}},
          {}};
}

}  // namespace tunnelrig::report
