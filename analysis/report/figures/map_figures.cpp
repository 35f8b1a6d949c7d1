#include "analysis/maps/contours.h"
#include "analysis/maps/measured_region.h"
#include "analysis/maps/picture.h"
#include "analysis/report/figures/figures.h"

#include <algorithm>

#include <fmt/format.h>

namespace tunnelrig::report {
namespace {

// Finer than a printer shows at the width of a column; with a column at ȳ = 0, where the picture changes from
// the measured to the mirrored half.
constexpr int kPrintedNodes = 241;
constexpr int kPrintedLevels = 9, kPrintedUncertaintyLevels = 4;

constexpr double kHatchingApart = 0.07;

constexpr double kLeft_mm = 14.2, kBottom_mm = 10, kTop_mm = 3;  // around the field

struct MapTexts {
  const char *name, *symbol, *caption;
};

/// Of the field, which leaves room for the colours and their numbers.
double side_of(const Picture& picture, double width_mm) {
  constexpr int kLettersThatFit = 5;
  constexpr double kRight_mm = 17.5, kLetter_mm = 1.5;
  return width_mm - kLeft_mm - kRight_mm - kLetter_mm * std::max(0, bar_letters(picture) - kLettersThatFit);
}

PictureFrame frame_of(const Sheet& sheet, double side_mm) {
  constexpr double kLabelWidth_mm = 6.2, kLabelHeight_mm = 2.6;
  return {.left = sheet.x(kLeft_mm),
          .right = sheet.x(kLeft_mm + side_mm),
          .bottom = sheet.y(kBottom_mm),
          .top = sheet.y(kBottom_mm + side_mm),
          .bar_left = sheet.x(kLeft_mm + side_mm + 2.5),
          .bar_width = sheet.x(2.8),
          .bar_label = sheet.x(sheet.width_mm - 2),
          .line_scale = 0.4,
          .titled = false,
          .label = {kLabelWidth_mm / side_mm, kLabelHeight_mm / side_mm}};
}

Figure drawn_map(const Picture& picture, const std::string& name, const std::string& caption,
                 double width_mm) {
  const double side_mm = side_of(picture, width_mm);
  const Sheet sheet{width_mm, side_mm + kBottom_mm + kTop_mm};
  const DrawnPicture drawn = draw_picture(picture, frame_of(sheet, side_mm));
  const std::string axes = sheet.axes({kLeft_mm, kLeft_mm + side_mm, kBottom_mm, kBottom_mm + side_mm},
                                      "← wall    ȳ [–]    wall →", "← ground    z̄ [–]    ceiling →", 11.2);
  const std::string small = fmt::format(
      "set tics font ',{0}' scale 0.5\nset border linewidth 0.5\nset cbtics scale 0.4 offset -0.6,0\nset "
      "xtics offset 0,0.3\n"
      "set style textbox opaque noborder margins 0.3,0.3\n",
      kSmallFont_pt);
  std::string plot = drawn.plot;
  const std::string labels = "with labels boxed";
  plot.insert(plot.find(labels) + labels.size(), fmt::format(" font ',{}'", kSmallFont_pt - 1));
  return {name, sheet, drawn.setup + axes + small + plot, caption};
}

/// The field, and its uncertainty.
void add_layer(const Material& material, const FittedField& field, const FitSummary& fit,
               const MapTexts& texts, double width_mm, Figures& figures) {
  const TunnelMaps& maps = *material.fitted;
  const MapGrid grid = regular_grid(kPrintedNodes);
  const MapLayer layer = sample(field, grid);
  Picture picture{.colour_label = fmt::format("{} [%]", texts.symbol),
                  .diverging = true,
                  .grid = grid,
                  .values = layer.value_percent,
                  .lines = contour_plot(grid, layer.value_percent, kPrintedLevels),
                  .geometry = maps.input.geometry};
  for (const LocationEstimate& location : maps.input.locations)
    picture.locations.push_back({location.y_norm, location.z_norm});
  picture.hatching = hatching(MeasuredRegion(picture.locations), kHatchingApart);
  const std::string shared = fmt::format(
      " across the tunnel, in per cent, against ȳ = 2y/(w_t − w_q) and z̄ = 2z/(h_t − h_q). "
      "Crosses: the {} measured locations; dashed lines, if any: mirror image of the measured half; "
      "hatched: beyond the locations, where U95 supposes that the field goes on as it is.",
      picture.locations.size());
  figures.drawn.push_back(drawn_map(
      picture, texts.name,
      texts.caption + shared +
          fmt::format(
              " Each location predicted from all others is off by {:.2f} percentage points (rms). Its "
              "uncertainty is the figure {}_u95.",
              fit.leave_one_out.rms_percent, texts.name),
      width_mm));
  picture.colour_label = fmt::format("U_{{95}}({}) [%]", texts.symbol);
  picture.diverging = false;
  picture.values = layer.u95_percent;
  picture.lines = contour_plot(grid, picture.values, kPrintedUncertaintyLevels);
  figures.drawn.push_back(drawn_map(
      picture, fmt::format("{}_u95", texts.name),
      fmt::format("U95 of the figure {} (half width of the 95 % interval)", texts.name) + shared, width_mm));
}

}  // namespace

Figures map_figures(const Material& material, double width_mm) {
  if (!material.fitted)
    return {{}, {{"delta_ct", material.not_mapped}, {"uneven_thrust", material.not_mapped}}};
  Figures figures;
  add_layer(
      material, material.fitted->delta_ct, material.map->delta_ct_fit,
      {"delta_ct", "ΔC_T", "Change of the thrust coefficient against that in the middle of the tunnel (OT)"},
      width_mm, figures);
  add_layer(material, material.fitted->uneven_thrust, material.map->uneven_thrust_fit,
            {"uneven_thrust", "U", "Uneven thrust U (right pair of rotors minus left pair, over all four)"},
            width_mm, figures);
  return figures;
}

}  // namespace tunnelrig::report
