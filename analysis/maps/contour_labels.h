// Where the numbers stand on the contour lines of a picture.
#pragma once

#include "analysis/maps/contours.h"
#include "datasets/locations.h"

#include <vector>

namespace tunnelrig {

struct ContourLabel {
  TunnelPoint at;
  double level = 0;
};

/// Half the extent of a label in the picture, in normalised coordinates.
struct LabelSize {
  double half_width = 0.1, half_height = 0.045;
};

/// At most one label a line, on a vertex of it, clear of the border, of each other, of the marked points and,
/// as far as there is room, of other lines. Lines too short or too crowded get none.
std::vector<ContourLabel> place_labels(const std::vector<ContourLine>& lines,
                                       const std::vector<TunnelPoint>& marks, const LabelSize& size = {});

}  // namespace tunnelrig
