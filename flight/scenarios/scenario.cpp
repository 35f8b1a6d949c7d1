#include "flight/scenarios/scenario.h"

#include "datasets/csv.h"
#include "datasets/error.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <numbers>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace tunnelrig {
namespace {

constexpr double kTurn_rad = 2 * std::numbers::pi;
constexpr std::array<std::string_view, 7> kNames = {"hover",     "diagonal", "ladder",        "circle",
                                                    "waypoints", "training", "identification"};

/// Where the centre of the vehicle can be: ± reach about the middle of the bounding box.
struct Room {
  Plane middle, reach;
  Plane at(double y_norm, double z_norm) const {
    return {middle[0] + y_norm * reach[0], middle[1] + z_norm * reach[1]};
  }
};

/// Upper left corner to the lower right one and back with ±0.1 m/s² (6.3, Figure 6.8), as far into the
/// corners as the section lets the vehicle.
Trajectory diagonal(const Room& room, const FlightSpace& space, const Airframe& frame) {
  const auto fits = [&](const Plane& at) {
    return space.walls.inside(at) && find_touch(space.walls, frame, at[0], at[1], 0, 1).depth_m <= 0;
  };
  double share = 0.7;
  while (share > 0.1 &&
         !(fits(room.at(-share - 0.1, share + 0.1)) && fits(room.at(share + 0.1, -share - 0.1))))
    share -= 0.1;
  Trajectory path;
  path.hold(room.at(-share, share), 3);
  path.move(room.at(share, -share), 0.1);
  path.hold(room.at(share, -share), 3);
  path.move(room.at(-share, share), 0.1);
  path.hold(room.at(-share, share), 3);
  return path;
}

/// y = 290 mm; height changes at 15 s and 30 s with 0.2 m/s² (6.3.2.1). The heights themselves are not
/// printed.
Trajectory ladder(const Room& room) {
  const double y = std::min(0.29, 0.8 * room.reach[0]);
  const std::array<double, 3> heights = {room.at(0, -0.5)[1], room.middle[1], room.at(0, 0.5)[1]};
  Trajectory path;
  path.hold({y, heights[0]}, 15);
  for (std::size_t i = 1; i < heights.size(); ++i) {
    const double begun_s = path.duration_s();
    path.move({y, heights[i]}, 0.2);
    path.hold({y, heights[i]}, std::max(0.0, begun_s + 15 - path.duration_s()));  // a long way takes longer
  }
  return path;
}

/// (6.31) and (6.32), whose t is in milliseconds; five turns. Other tunnels: what fits, as fast.
Scenario circle(const std::string& tunnel, const Room& room) {
  double radius_m = 0.8 * std::min(room.reach[0], room.reach[1]), rate = 0.44 / radius_m;
  Plane centre = room.middle;
  if (tunnel == "2.4") radius_m = 0.7, rate = 0.1 * kTurn_rad, centre = {0, 0.9};
  if (tunnel == "1.5") radius_m = 0.3, rate = 0.23 * kTurn_rad, centre = {0, 0.65};
  Scenario scenario{.score_from_s = kTurn_rad / rate};
  scenario.trajectory.circle(centre, radius_m, rate, 5);
  return scenario;
}

/// (0, .6) → (1, 1.1) → (1, 1.5) → (0, .6) m (6.3.3); where the tunnel does not hold that, the same figure as
/// far as it does.
Trajectory waypoints(const Room& room) {
  std::array<Plane, 4> points = {{{0, 0.6}, {1, 1.1}, {1, 1.5}, {0, 0.6}}};
  if (room.reach[0] < 1.1 || room.at(0, 1)[1] < 1.6)
    points = {{room.at(0, -0.6), room.at(0.7, 0), room.at(0.7, 0.5), room.at(0, -0.6)}};
  Trajectory path;
  path.hold(points[0], 5);
  for (std::size_t i = 1; i < points.size(); ++i) {
    path.move(points[i], 0.2, 0.4);
    path.hold(points[i], 5);
  }
  return path;
}

/// Five seconds of hover and a figure through all quarters of the tunnel, like none of the paths that are
/// compared.
Trajectory training(const Room& room) {
  Trajectory path;
  path.hold(room.at(0, 0.6), 5);
  path.figure(room.middle, {0.6 * room.reach[0], 0.6 * room.reach[1]}, {kTurn_rad / 5, kTurn_rad / 8}, 25);
  return path;
}

/// Quick up and down at three heights, so that place and acceleration do not go together: what the residual
/// depends on can be told apart.
Trajectory identification(const Room& room) {
  constexpr int kTurns = 6;
  constexpr double kRate_rad_s = 3.7, kDuration_s = kTurns * kTurn_rad / kRate_rad_s;
  const Plane amplitude = {0.5 * room.reach[0], 0.2 * room.reach[1]};
  Trajectory path;
  path.hold(room.at(0, -0.5 + 0.2), 2);
  for (const double z_norm : {-0.5, 0.0, 0.5}) {
    if (z_norm > -0.5) path.move(room.at(0, z_norm + 0.2), 1);
    path.figure(room.at(0, z_norm), amplitude, {5 * kTurn_rad / 2 / kDuration_s, kRate_rad_s}, kDuration_s);
  }
  return path;
}

}  // namespace

std::span<const std::string_view> scenario_names() { return kNames; }

std::string tunnel_of_scenario(const std::string& name) {
  if (std::find(kNames.begin(), kNames.end(), name) != kNames.end()) return {};
  if (!std::filesystem::is_regular_file(name)) return {};  // scenario_from says what is wrong
  return parse_scenario(read_text(name), name).tunnel;
}

Scenario scenario_from(const std::string& name, const FlightSpace& space, const Airframe& frame) {
  const SectionScale scale = space.scale(frame);
  const Room room{space.middle_m(), {scale.half_span_y_m, scale.half_span_z_m}};
  Scenario scenario;
  if (name == "hover") {
    scenario.trajectory.hold(room.middle, 30);
  } else if (name == "diagonal") {
    scenario.trajectory = diagonal(room, space, frame);
  } else if (name == "ladder") {
    scenario.trajectory = ladder(room);
  } else if (name == "circle") {
    scenario = circle(space.tunnel.name, room);
  } else if (name == "waypoints") {
    scenario.trajectory = waypoints(room);
  } else if (name == "training") {
    scenario.trajectory = training(room);
  } else if (name == "identification") {
    scenario.trajectory = identification(room);
  } else if (std::filesystem::is_regular_file(name)) {
    scenario = parse_scenario(read_text(name), name);
  } else {
    throw InputError(
        fmt::format("no scenario {}: neither a file nor one of {}", name, fmt::join(kNames, ", ")));
  }
  if (scenario.name.empty()) scenario.name = name;
  check_scenario(scenario, space, frame);
  return scenario;
}

void check_scenario(const Scenario& scenario, const FlightSpace& space, const Airframe& frame) {
  constexpr double kStep_s = 0.02;
  const auto steps = static_cast<long>(std::ceil(scenario.trajectory.duration_s() / kStep_s));
  for (long i = 0; i <= steps; ++i) {
    const double t = static_cast<double>(i) * kStep_s;
    const Plane at = scenario.trajectory.at(t).position_m;
    if (space.walls.inside(at) && find_touch(space.walls, frame, at[0], at[1], 0, 1).depth_m <= 0) continue;
    throw InputError::in(
        "scenario " + scenario.name,
        "{} at y = {:.3f} m, {:.3f} m above the floor{} (the vehicle is {:.3f} m wide, {:.3f} m high)",
        i > 0 ? "it leaves the tunnel" : "it starts inside a wall", at[0], at[1],
        i > 0 ? fmt::format(", t = {:.2f} s", t) : "", frame.width_m, frame.height_m);
  }
}

}  // namespace tunnelrig
