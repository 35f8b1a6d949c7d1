// The tunnel in the flight frame (origin at the middle of the lower edge), as vehicle and scenarios meet it.
#pragma once

#include "analysis/maps/disturbance_map.h"
#include "flight/scenarios/trajectory.h"
#include "flight/tunnel/tunnel.h"
#include "flight/vehicle/contact.h"
#include "flight/vehicle/section_scale.h"

#include <string>

namespace tunnelrig {

struct FlightSpace {
  FlightTunnel tunnel;
  Walls walls;
  // Of the lower edge, small features aside, in the cross-section's own frame: z_flight = z_section −
  // floor_m.
  double floor_m = 0;

  /// Throws InputError where the vehicle is as wide as the tunnel or wider, or as high.
  FlightSpace(FlightTunnel shape, const Airframe& frame);

  /// (4.1), (4.2) for this tunnel's bounding box without small features.
  SectionScale scale(const Airframe& frame) const;

  /// Middle of that box.
  Plane middle_m() const;
};

/// What differs, in words, where a map was made in another tunnel or with another vehicle by more than one
/// per cent; empty where it fits. Such a map is flown in normalised coordinates, as an extrapolation.
std::string extrapolation(const MapGeometry& map, const FlightSpace& space, const Airframe& frame);

}  // namespace tunnelrig
