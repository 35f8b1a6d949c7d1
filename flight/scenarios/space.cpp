#include "flight/scenarios/space.h"

#include "datasets/error.h"

#include <cmath>
#include <utility>

#include <fmt/format.h>

namespace tunnelrig {
namespace {

std::vector<Point> corners_above(const CrossSection& section, double floor_m) {
  std::vector<Point> corners;
  for (const SectionPoint& v : section.vertices()) corners.push_back({v.x(), v.y() - floor_m});
  return corners;
}

bool differ(double a, double b) { return std::abs(a - b) > 0.01 * b; }

}  // namespace

FlightSpace::FlightSpace(FlightTunnel shape, const Airframe& frame)
    : tunnel(std::move(shape)),
      walls(corners_above(tunnel.section, tunnel.box().lowest.y())),
      floor_m(tunnel.box().lowest.y()) {
  const SectionBox box = tunnel.box();
  if (frame.width_m >= box.width_m())
    throw InputError::in("tunnel " + tunnel.name,
                         "{:g} m wide, and the vehicle is {:g} m wide from tip to tip", box.width_m(),
                         frame.width_m);
  if (frame.height_m >= box.height_m())
    throw InputError::in("tunnel " + tunnel.name, "{:g} m high, and the vehicle is {:g} m high",
                         box.height_m(), frame.height_m);
}

Plane FlightSpace::middle_m() const {
  const SectionPoint middle = tunnel.box().middle();
  return {middle.x(), middle.y() - floor_m};
}

SectionScale FlightSpace::scale(const Airframe& frame) const {
  return {middle_m()[0], middle_m()[1], 0.5 * (tunnel.box().width_m() - frame.width_m),
          0.5 * (tunnel.box().height_m() - frame.height_m)};
}

std::string extrapolation(const MapGeometry& map, const FlightSpace& space, const Airframe& frame) {
  const SectionBox section = space.tunnel.box();
  std::string text;
  if (differ(section.width_m(), map.tunnel_width_m) || differ(section.height_m(), map.tunnel_height_m)) {
    text = fmt::format("the map is of a tunnel of {:g} x {:g} m, this one is {:g} x {:g} m",
                       map.tunnel_width_m, map.tunnel_height_m, section.width_m(), section.height_m());
  }
  if (differ(frame.width_m, map.vehicle_width_m) || differ(frame.height_m, map.vehicle_height_m)) {
    text += fmt::format("{}the map's vehicle is {:g} x {:g} m, this one is {:g} x {:g} m",
                        text.empty() ? "" : "; ", map.vehicle_width_m, map.vehicle_height_m, frame.width_m,
                        frame.height_m);
  }
  return text;
}

}  // namespace tunnelrig
