// A field of the tunnel's cross-section as a picture, in the manner of the thesis's figures 5.58 and 5.59.
#pragma once

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
  std::vector<TunnelPoint> locations;  // measured; a half without any has dashed lines
  MapGeometry geometry;
};

/// A gnuplot script that carries its data and writes `stem`.svg and `stem`.png into the working folder.
std::string gnuplot_script(const Picture& picture, const std::string& stem);

}  // namespace tunnelrig
