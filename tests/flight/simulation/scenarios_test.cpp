#include "datasets/csv.h"
#include "datasets/error.h"
#include "flight/scenarios/scenario.h"
#include "support/temporary_folder.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

using testing::HasSubstr;

struct Scenarios : testing::Test {
  Airframe frame;
  FlightSpace space{tunnel_from("1.5"), frame};

  std::string refusal(const std::string& text) {
    try {
      check_scenario(parse_scenario("format = \"tunnelrig-scenario/1\"\n" + text, "s.toml"), space, frame);
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  }
};

TEST_F(Scenarios, OfTheThesisFitEveryTunnelOfTheThesis) {
  for (const char* tunnel : {"1.5", "2.4", "railway"}) {
    const FlightSpace there(tunnel_from(tunnel), frame);
    for (const std::string_view name : scenario_names())
      EXPECT_NO_THROW(scenario_from(std::string(name), there, frame)) << name << " in " << tunnel;
  }
}

/// A bay, and a pit in the floor, change neither heights nor where the map is.
TEST_F(Scenarios, SmallFeaturesMakeNoOtherTunnel) {
  const std::string square = "name = \"t\"\nlength_m = 10\nshape = \"square\"\nwidth_m = 1.6\n";
  const FlightSpace plain(parse_tunnel(square, "t.toml"), frame);
  const SectionScale expected = plain.scale(frame);
  for (const char* feature : {"edge = 1\nfrom_m = 0.5\nto_m = 0.8\ninward_m = -0.5\n",
                              "edge = 0\nfrom_m = 0.5\nto_m = 0.8\ninward_m = -0.3\n"}) {
    const FlightSpace there(parse_tunnel(square + "[[feature]]\n" + feature, "t.toml"), frame);
    EXPECT_DOUBLE_EQ(there.floor_m, plain.floor_m);
    const SectionScale scale = there.scale(frame);
    EXPECT_DOUBLE_EQ(scale.y_norm(0.2), expected.y_norm(0.2));
    EXPECT_DOUBLE_EQ(scale.z_norm(1), expected.z_norm(1));
  }
}

TEST_F(Scenarios, FitLowAndTallTunnelsTooWithoutAJump) {
  const test::TemporaryFolder folder;
  for (const double height_m : {1.2, 1.5, 60.0}) {
    write_text(folder / "box.toml",
               fmt::format("name = \"box\"\nshape = \"box\"\nwidth_m = 4\nheight_m = {}\nlength_m = 10\n",
                           height_m));
    const FlightSpace there(tunnel_from((folder / "box.toml").string()), frame);
    for (const char* name : {"hover", "diagonal", "ladder", "waypoints"}) {
      SCOPED_TRACE(fmt::format("{} in {} m", name, height_m));
      const Trajectory path = scenario_from(name, there, frame).trajectory;
      Plane before = path.at(0).position_m;
      double farthest_m = 0;
      for (double t = 0; t <= path.duration_s(); t += 0.02) {
        const Plane at = path.at(t).position_m;
        farthest_m = std::max(farthest_m, std::hypot(at[0] - before[0], at[1] - before[1]));
        before = at;
      }
      EXPECT_LT(farthest_m, 0.5) << "m within 20 ms";
    }
  }
}

TEST_F(Scenarios, PathsAreSmoothAndTheirDerivativesTrue) {
  for (const std::string_view name : scenario_names()) {
    const Trajectory path = scenario_from(std::string(name), space, frame).trajectory;
    constexpr double kStep_s = 1e-4;
    const int steps = static_cast<int>((path.duration_s() - 0.1) / 0.0937);
    for (int step = 0; step <= steps; ++step) {
      const double t = 0.05 + 0.0937 * step;
      const PlanarReference now = path.at(t), before = path.at(t - kStep_s), after = path.at(t + kStep_s);
      for (std::size_t i = 0; i < 2; ++i) {
        EXPECT_NEAR(now.velocity_m_s[i], (after.position_m[i] - before.position_m[i]) / (2 * kStep_s), 1e-4)
            << name << t;
      }
    }
  }
}

TEST_F(Scenarios, TheCirclesAreThosePrinted) {
  const Scenario circle = scenario_from("circle", space, frame);
  const double turn_s = 2 * std::numbers::pi / (0.46 * std::numbers::pi);  // (6.32), t in milliseconds
  EXPECT_NEAR(circle.score_from_s, turn_s, 1e-9);
  const PlanarReference quarter = circle.trajectory.at(turn_s / 4);
  EXPECT_NEAR(quarter.position_m[0], 0.3, 1e-9);
  EXPECT_NEAR(quarter.position_m[1], 0.65, 1e-9);
  EXPECT_NEAR(quarter.velocity_m_s[1], -0.3 * 0.46 * std::numbers::pi, 1e-9);
  const FlightSpace large(tunnel_from("2.4"), frame);
  EXPECT_NEAR(scenario_from("circle", large, frame).score_from_s, 10, 1e-9);
}

TEST_F(Scenarios, FilesAreRead) {
  const Scenario scenario = parse_scenario(
      "format = \"tunnelrig-scenario/1\"\nname = \"up\"\nstart = [0, 0.5]\nscore_from_s = 1\n"
      "[[segments]]\nkind = \"hold\"\nduration_s = 2\n[[segments]]\nkind = \"move\"\nto = [0, "
      "0.9]\nacceleration_m_s2 = 0.1\n",
      "s.toml");
  EXPECT_EQ(scenario.name, "up");
  EXPECT_NEAR(scenario.trajectory.duration_s(), 2 + 2 * std::sqrt(0.4 / 0.1), 1e-9);
  EXPECT_NEAR(scenario.trajectory.at(100).position_m[1], 0.9, 1e-12);
}

TEST_F(Scenarios, BadOnesAreRefusedWithTheRule) {
  const std::string hold = "[[segments]]\nkind = \"hold\"\nduration_s = 2\n";
  EXPECT_EQ(refusal("start = [0, 0.5]\n" + hold), "accepted");
  EXPECT_THAT(refusal("start = [0, 0.1]\n" + hold),
              HasSubstr("starts inside a wall at y = 0.000 m, 0.100 m"));
  EXPECT_THAT(refusal("start = [0, 9]\n" + hold), HasSubstr("starts inside a wall"));
  EXPECT_THAT(refusal("start = [0, 0.5]\n" + hold +
                      "[[segments]]\nkind = \"move\"\nto = [0.5, 0.5]\nacceleration_m_s2 = 1\n"),
              HasSubstr("leaves the tunnel at y = 0.3"));
  EXPECT_THAT(refusal(hold), HasSubstr("start is missing"));
  EXPECT_THAT(refusal("start = [0, nan]\n" + hold), HasSubstr("s.toml:2"));
  EXPECT_THAT(refusal("start = [0, 0.5]\n[[segments]]\nkind = \"jump\"\n"), HasSubstr("kind must be"));
  EXPECT_THAT(refusal("start = [0, 0.5]\n" + hold +
                      "[[segments]]\nkind = \"circle\"\ncentre = [0, 0.7]\nradius_m = 0.1\n"
                      "rate_rad_s = 1\nturns = 1\n"),
              HasSubstr("the one before ends at"));
  EXPECT_THAT(refusal("segments = 3\n"), HasSubstr("no [[segments]]"));
  EXPECT_THAT(refusal("start = [0, 0.5]\ntunel = \"2.4\"\n" + hold),
              HasSubstr("s.toml:3: the file: tunel is no key here; known are format, name, start, tunnel"));
  EXPECT_THAT(refusal("start = [0, 0.5]\n" + hold +
                      "[[segments]]\nkind = \"move\"\nto = [0, 0.6]\nacceleration_m_s2 = 1\nspeed_ms = 1\n"),
              HasSubstr("move: speed_ms is no key here"));
  EXPECT_THAT(refusal("start = [0, 0.5]\n" + hold + "to = [0, 1]\n"), HasSubstr("hold: to is no key here"));
}

TEST_F(Scenarios, AVehicleWiderThanTheTunnelIsRefused) {
  frame.width_m = 1.6;
  EXPECT_THROW(FlightSpace(tunnel_from("1.5"), frame), InputError);
  frame = {};
  frame.height_m = 1.5;
  EXPECT_THROW(FlightSpace(tunnel_from("1.5"), frame), InputError);
}

TEST_F(Scenarios, AMapOfAnotherTunnelIsLabelled) {
  const MapGeometry map{0.7434, 0.3, 1.5, 1.5, 0.1524};
  EXPECT_EQ(extrapolation(map, space, frame), "");
  EXPECT_THAT(extrapolation(map, FlightSpace(tunnel_from("2.4"), frame), frame), HasSubstr("2.35 x 2.39"));
}

}  // namespace
}  // namespace tunnelrig
