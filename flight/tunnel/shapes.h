// Outlines of common tunnels, as vertices counter-clockwise, centred on their bounding box.
#pragma once

#include "flight/tunnel/cross_section.h"

#include <vector>

namespace tunnelrig {

/// Box culvert; a square where both are equal. Edges: 0 floor, 1 right wall, 2 ceiling, 3 left wall.
std::vector<SectionPoint> box_outline(double width_m, double height_m);

/// Railway tunnel: floor (edge 0), right wall (1), elliptic arch of `segments` edges that springs at
/// `wall_height_m`, left wall (the last). A half circle where height − wall height is half the width.
std::vector<SectionPoint> arch_outline(double width_m, double height_m, double wall_height_m,
                                       int segments = 24);

/// A circle of the given area by a regular polygon: its edges lie as much inside the circle as outside.
std::vector<SectionPoint> circle_outline(double diameter_m, int segments = 72);

/// A rectangle put into the outline or taken out of it, on one straight edge: a cable tray (inward_m > 0)
/// or a refuge bay (inward_m < 0), from `from_m` to `to_m` along the edge in the direction it runs.
struct SectionFeature {
  std::size_t edge = 0;  // of the outline before any feature
  double from_m = 0;
  double to_m = 0;
  double inward_m = 0;
};

/// The outline with the features. Throws InputError, with `name` in front, for an edge that is not there and
/// a feature that does not lie within its edge or overlaps another one on it.
std::vector<SectionPoint> with_features(const std::vector<SectionPoint>& outline,
                                        std::vector<SectionFeature> features, const std::string& name);

/// Moves the centre of the bounding box to the origin.
std::vector<SectionPoint> centred(std::vector<SectionPoint> outline);

}  // namespace tunnelrig
