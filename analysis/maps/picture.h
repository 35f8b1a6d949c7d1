// A field of the tunnel's cross-section as a picture, in the manner of the thesis's figures 5.58 and 5.59.
#pragma once

#include "analysis/maps/contour_labels.h"
#include "analysis/maps/contours.h"
#include "analysis/maps/disturbance_map.h"
#include "datasets/locations.h"

#include <string>
#include <vector>

namespace tunnelrig {

struct Picture {
  std::string title;         // gnuplot's enhanced text, as the two others
  std::string note;          // second line, smaller
  std::string colour_label;  // quantity and unit
  bool diverging = false;    // colours centred at 0; else from 0 upwards
  MapGrid grid;
  std::vector<double> values;
  std::vector<ContourLine> lines;
  std::vector<TunnelPoint> locations;              // measured; a half without any has dashed lines
  std::vector<std::vector<TunnelPoint>> hatching;  // lines over what lies beyond the locations
  MapGeometry geometry;
};

/// Where a picture stands on its canvas, in fractions of it, and how heavy its lines are.
struct PictureFrame {
  double left = 0.135, right = 0.73, bottom = 0.125, top = 0.807;  // of the field
  double bar_left = 0.85, bar_width = 0.028, bar_label = 0.975;    // of the colours beside it
  double line_scale = 1;                                           // over the lines of `map`
  bool titled = true;  // with title, note, titles of the axes and axes in metres; else the caller has its own
  LabelSize label;
};

/// Commands for gnuplot, which carry their data: what is the same for all terminals, and the plot itself.
struct DrawnPicture {
  std::string setup, plot;
};

/// Letters of the longest number beside the colours.
int bar_letters(const Picture& picture);

DrawnPicture draw_picture(const Picture& picture, const PictureFrame& frame = {});

/// A gnuplot script that writes `stem`.svg and `stem`.png into the working folder.
std::string gnuplot_script(const Picture& picture, const std::string& stem);

}  // namespace tunnelrig
