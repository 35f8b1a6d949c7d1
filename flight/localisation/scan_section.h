// A scan as the reference of other scans: the outline of what it saw. For the tests on published scans; the
// tunnel's section is known.
#pragma once

#include "flight/lidar/scan.h"
#include "flight/tunnel/cross_section.h"

namespace tunnelrig {

struct ScanSectionSettings {
  double tolerance_m = 0.02;  // vertices less than this from the line between others are left out
  double most_range_m = 30;
  double behind_m = 1;  // how far the outline reaches where the LIDAR does not look
};

/// The section seen by a scan, in axes parallel to the scan plane's, with the LIDAR at the origin: the
/// thesis's "reference scan taken at the entrance". Throws InputError for NaN, a wrong number of beams, or
/// fewer than ten returns.
CrossSection section_from_scan(const Scan& scan, const BeamLayout& layout,
                               const ScanSectionSettings& settings = {});

}  // namespace tunnelrig
