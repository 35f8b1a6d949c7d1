// What no unbiased matcher can do better than: tests and benchmarks hold the matcher against it, no flight
// needs it.
#pragma once

#include "flight/lidar/scan.h"
#include "flight/tunnel/cross_section.h"

#include <Eigen/Core>

namespace tunnelrig {

/// Cramér–Rao bound of the position in the section from one scan, every beam with an independent Gaussian
/// range error and the attitude known: covariance of y and z, m²; with the rotation in the scan plane
/// unknown, of y, z and rotation.
Eigen::MatrixXd cramer_rao_bound(const CrossSection& section, const BeamLayout& layout,
                                 const SectionPoint& position, const Attitude& attitude, double range_sigma_m,
                                 bool rotation_unknown = false);

}  // namespace tunnelrig
