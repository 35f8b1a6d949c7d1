// The sheet that a figure is drawn on, in millimetres and points. Internal to analysis/report/figures.
#pragma once

#include "analysis/maps/gnuplot.h"
#include "analysis/report/figures/write_figures.h"

#include <string>
#include <string_view>
#include <vector>

namespace tunnelrig::report {

/// Fonts of a printed figure, in points; 7 is what most journals ask for at least.
constexpr double kFont_pt = 8, kSmallFont_pt = 7;

/// Edges of a plot on a sheet, from the left and from below.
struct Box {
  double left_mm = 0, right_mm = 0, bottom_mm = 0, top_mm = 0;
};

/// Places on a sheet as gnuplot takes them: fractions of it, from below and from the left.
struct Sheet {
  double width_mm = 84, height_mm = 60;

  double x(double from_left_mm) const { return from_left_mm / width_mm; }
  double y(double from_below_mm) const { return from_below_mm / height_mm; }

  /// A plot between these edges, and the titles of its axes at fixed distances from them, which gnuplot would
  /// otherwise guess from fonts it does not know. Empty titles: none. The left one stands that far from the
  /// plot: more than the numbers of the axis take.
  std::string axes(const Box& box, const std::string& below, const std::string& left,
                   double left_distance_mm = 11.5) const;
};

/// "set terminal … set output …" of a file of this name. Line widths and point sizes are in points of the
/// same size in all three formats.
std::string terminal(const Sheet& sheet, FigureFormat format, const std::string& file);

/// What a plot looks like before anything is said of it: fonts, thin axes, a grid, no key.
std::string look();

/// What a curve looks like in a legend.
struct LegendEntry {
  std::string text;    // a user's, perhaps: drawn as it is
  std::string colour;  // "#0072B2"
  int point = 0;       // gnuplot's type; 0: none
  int dash = 1;        // gnuplot's type; 0: no line but a wide band
  double line_width = 0.7;
};

/// Points that look alike in size: triangles and diamonds are smaller than their type says.
double point_size(int point);

/// How bars are drawn, from x, y, Δx and Δy: gnuplot's own errorbars blank a disc around a small point.
constexpr const char* kBars = "with vectors heads size screen 0.006,90";

constexpr double kLegendRow_mm = 3.3;

/// A legend in so many columns over the whole width, row by row; the first one's middle is at that height. At
/// fixed places: gnuplot's own key guesses the widths of texts, differently for each format. `first` is the
/// number of its first label and arrow; each entry takes two of the one and one of the other.
std::string legend(const Sheet& sheet, const std::vector<LegendEntry>& entries, double top_mm, int columns,
                   double left_mm, int first = 200);

/// Between panels of one sheet: what was written on it is not written again.
constexpr const char* kNextPanel = "unset label\nunset arrow\n";

/// A drawn file with what gnuplot cannot say itself: an SVG is so many millimetres wide and carries its font,
/// a PNG has so many dots per metre.
std::string completed(std::string file, const Sheet& sheet, FigureFormat format);

}  // namespace tunnelrig::report
