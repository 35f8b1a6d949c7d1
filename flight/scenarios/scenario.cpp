#include "flight/scenarios/scenario.h"

#include "datasets/csv.h"
#include "datasets/error.h"

#include <algorithm>
#include <array>
#include <numbers>

#include <fmt/ranges.h>

namespace tunnelrig {
namespace {

constexpr std::array<std::string_view, 6> kNames = {"hover",  "diagonal",  "ladder",
                                                    "circle", "waypoints", "figure"};
constexpr double kSettle_s = 5;  // at rest before anything moves

/// Room of the vehicle's centre on either side of the middle.
struct Room {
  Plane middle_m, half_m;
};

Room room(const FlightSpace& space, const Airframe& frame) {
  const SectionScale scale = space.scale(frame);
  return {space.middle_m(), {scale.half_span_y_m, scale.half_span_z_m}};
}

bool is_small_tunnel(const Room& room) { return room.half_m[0] < 0.6; }

Scenario hover(const Room& room) {
  Scenario s{.name = "hover", .score_from_s = kSettle_s};
  s.trajectory.hold(room.middle_m, 35);
  return s;
}

/// From the upper left to the lower right and back at ±0.1 m/s² (6.8); 6.9 prints no lengths.
Scenario diagonal(const Room& room) {
  Scenario s{.name = "diagonal", .score_from_s = kSettle_s};
  const Plane to = {0.65 * room.half_m[0], 0.6 * room.half_m[1]};
  const Plane high = {room.middle_m[0] - to[0], room.middle_m[1] + to[1]};
  const Plane low = {room.middle_m[0] + to[0], room.middle_m[1] - to[1]};
  s.trajectory.hold(high, kSettle_s);
  for (int i = 0; i < 2; ++i) {
    s.trajectory.move(low, 0.1);
    s.trajectory.hold(low, 2);
    s.trajectory.move(high, 0.1);
    s.trajectory.hold(high, 2);
  }
  return s;
}

/// At y = 290 mm, heights changed with 0.2 m/s² at about 15 s and 30 s (6.13); the heights are not printed.
Scenario ladder(const Room& room) {
  Scenario s{.name = "ladder", .score_from_s = kSettle_s};
  const double y = room.middle_m[0] + 0.29, step = 0.5 * room.half_m[1];
  s.trajectory.hold({y, room.middle_m[1] - step}, 15);
  s.trajectory.move({y, room.middle_m[1]}, 0.2);
  s.trajectory.hold({y, room.middle_m[1]}, 30 - s.trajectory.duration_s());
  s.trajectory.move({y, room.middle_m[1] + step}, 0.2);
  s.trajectory.hold({y, room.middle_m[1] + step}, 45 - s.trajectory.duration_s());
  return s;
}

/// (6.31) and (6.32) with t in seconds: as printed, in milliseconds, they would turn a thousand times as
/// fast.
Scenario circle(const Room& room) {
  constexpr double kPi = std::numbers::pi;
  const bool small = is_small_tunnel(room);
  const double radius = small ? 0.3 : 0.7, height = small ? 0.65 : 0.9, rate = small ? 0.46 * kPi : 0.2 * kPi;
  const double turn_s = 2 * kPi / rate, turns = small ? 8 : 5;
  Scenario s{.name = "circle"};
  s.trajectory.hold({0, height + radius}, kSettle_s);
  s.trajectory.circle({0, height}, radius, rate, turns);
  s.score_from_s = kSettle_s + turn_s;  // after the first turn
  return s;
}

/// Section 6.3.3; the way between waypoints is the autopilot's, here with 0.2 m/s² and 0.5 m/s.
Scenario waypoints(const Room& room) {
  Scenario s{.name = "waypoints", .score_from_s = kSettle_s};
  const double scale = std::min(1.0, 0.8 * room.half_m[0]);
  const Plane home = {0, 0.6}, crack = {scale, 1.1},
              above = {scale, std::min(1.5, room.middle_m[1] + 0.8 * room.half_m[1])};
  s.trajectory.hold(home, 10);
  for (const Plane& point : {crack, above, home}) {
    s.trajectory.move(point, 0.2, 0.5);
    s.trajectory.hold(point, 8);
  }
  return s;
}

/// A Lissajous figure through all quarters, with other frequencies than the circles; after a hover.
Scenario figure(const Room& room) {
  Scenario s{.name = "figure", .score_from_s = kSettle_s};
  const Plane amplitude = {0.55 * room.half_m[0], 0.45 * room.half_m[1]};
  s.trajectory.hold({room.middle_m[0], room.middle_m[1] + amplitude[1]}, kSettle_s);
  s.trajectory.figure(room.middle_m, amplitude, {0.8, 1.1}, 30);
  return s;
}

}  // namespace

std::span<const std::string_view> scenario_names() { return kNames; }

Scenario scenario_from(const std::string& name_or_file, const FlightSpace& space, const Airframe& frame) {
  const Room r = room(space, frame);
  if (name_or_file == "hover") return hover(r);
  if (name_or_file == "diagonal") return diagonal(r);
  if (name_or_file == "ladder") return ladder(r);
  if (name_or_file == "circle") return circle(r);
  if (name_or_file == "waypoints") return waypoints(r);
  if (name_or_file == "figure") return figure(r);
  if (!std::filesystem::exists(name_or_file))
    throw InputError(fmt::format("no scenario and no file is called '{}'; there are {}", name_or_file,
                                 fmt::join(kNames, ", ")));
  return parse_scenario(read_text(name_or_file), name_or_file);
}

std::string tunnel_of_scenario(const std::string& name_or_file) {
  if (name_or_file == "waypoints") return "railway";
  if (std::find(kNames.begin(), kNames.end(), name_or_file) != kNames.end()) return "1.5";
  if (!std::filesystem::exists(name_or_file)) return "1.5";
  const std::string tunnel = parse_scenario(read_text(name_or_file), name_or_file).tunnel;
  return tunnel.empty() ? "1.5" : tunnel;
}

void check_scenario(const Scenario& scenario, const FlightSpace& space, const Airframe& frame) {
  constexpr double kStep_s = 0.02;
  const double duration = scenario.trajectory.duration_s();
  const auto steps = static_cast<long>(duration / kStep_s);
  for (long i = 0; i <= steps; ++i) {
    const double t = static_cast<double>(i) * kStep_s;
    const Plane p = scenario.trajectory.at(t).position_m;
    const bool in = space.walls.inside(p);
    const Touch touch = in ? find_touch(space.walls, frame, p[0], p[1], 0, 1) : Touch{};
    if (in && touch.depth_m <= 0) continue;
    throw InputError::in(
        "scenario " + scenario.name,
        "{} tunnel {} at {:.2f} s: the vehicle's centre would be at ({:.3f}, {:.3f}) m and {}",
        i == 0 ? "starts inside a wall of" : "leaves", space.tunnel.name, t, p[0], p[1],
        in ? fmt::format("the vehicle {:.0f} mm in the wall near ({:.3f}, {:.3f}) m", 1000 * touch.depth_m,
                         touch.at[0], touch.at[1])
           : std::string("outside of it"));
  }
}

}  // namespace tunnelrig
