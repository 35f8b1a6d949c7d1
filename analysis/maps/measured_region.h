// Where a map interpolates between locations, and where it goes on beyond them.
#pragma once

#include "analysis/maps/disturbance_map.h"
#include "datasets/locations.h"

#include <vector>

namespace tunnelrig {

/// The convex hull of the measured locations and their mirror images. Inside it a field has locations on all
/// sides; outside its uncertainty supposes that it goes on as it is, which walls, ground and ceiling need not
/// keep (docs/maps.md).
class MeasuredRegion {
 public:
  explicit MeasuredRegion(const std::vector<TunnelPoint>& locations);

  /// On its border too. Locations on a line hold that line only.
  bool holds(const TunnelPoint& point) const;

  /// Of the square [−1, 1]² that the vehicle can reach, 0 to 1.
  double share_outside() const;

  /// Its corners counterclockwise, from the lowest of the leftmost on.
  const std::vector<TunnelPoint>& corners() const { return corners_; }

 private:
  std::vector<TunnelPoint> corners_;
};

/// Of the map's measured locations, whichever program wrote it.
MeasuredRegion measured_region(const DisturbanceMap& map);

/// Two ends each: lines at 45° that fill the square outside the region, `apart` from one another across.
std::vector<std::vector<TunnelPoint>> hatching(const MeasuredRegion& region, double apart);

}  // namespace tunnelrig
