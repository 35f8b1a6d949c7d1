// Which wall each beam of a scan should meet, from a place in the section.
#pragma once

#include "flight/lidar/scan.h"
#include "flight/localisation/beam_kernels.h"
#include "flight/tunnel/cross_section.h"

#include <vector>

#include <Eigen/Core>

namespace tunnelrig {

/// An edge is seen in the interval of angles between its ends, so each edge is put to those beams alone: all
/// beams of a convex section cost one pass, however many edges it has.
class VisibleWalls {
 public:
  VisibleWalls(const CrossSection& section, const BeamLayout& layout);

  /// Fills inverse and, where that is not 0, wall_y and wall_z of beams whose directions have been projected
  /// with the same `projection`, and are off their places in the layout by at most `bent_beams`.
  void look(const BeamKernels& kernels, const Beams& beams, const Eigen::Matrix2d& projection,
            const SectionPoint& from, double bent_beams);

 private:
  struct Edge {
    double normal_y, normal_z;  // outward, unit length
    double offset;              // normal · any point of the edge
  };

  BeamLayout layout_;
  double full_turn_;  // in beams
  std::vector<SectionPoint> vertices_;
  std::vector<Edge> edges_;
  std::vector<double> seen_at_;  // each vertex, in beams
};

}  // namespace tunnelrig
