#include "flight/tunnel/tunnel.h"

#include "support/message_of.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

using test::message_of;
using testing::AllOf;
using testing::HasSubstr;

std::string wrong(const std::string& toml) {
  return message_of([&] { parse_tunnel(toml, "t.toml"); });
}

TEST(Tunnel, ThesisTunnelsByName) {
  EXPECT_DOUBLE_EQ(tunnel_from("1.5").section.width_m(), 1.5);
  EXPECT_DOUBLE_EQ(tunnel_from("2.4").section.height_m(), 2.39);
  const FlightTunnel railway = tunnel_from("railway");
  EXPECT_NEAR(railway.section.width_m(), 6.3 * 0.715, 0.01);
  EXPECT_NEAR(railway.section.height_m(), 16.7 * 0.3, 0.02);
  EXPECT_THAT(message_of([] { tunnel_from("3.7"); }), HasSubstr("no such tunnel"));
}

TEST(Tunnel, EveryShapeOfTheFileFormat) {
  const auto section = [](const std::string& rest) {
    return parse_tunnel("name = \"t\"\nlength_m = 10\n" + rest, "t.toml").section;
  };
  EXPECT_DOUBLE_EQ(section("shape = \"square\"\nwidth_m = 2").height_m(), 2);
  EXPECT_DOUBLE_EQ(section("shape = \"box\"\nwidth_m = 2\nheight_m = 3").height_m(), 3);
  EXPECT_NEAR(section("shape = \"circle\"\ndiameter_m = 2").width_m(), 2, 0.005);
  const CrossSection arch = section("shape = \"arch\"\nwidth_m = 4\nheight_m = 5\nwall_height_m = 3");
  EXPECT_DOUBLE_EQ(arch.height_m(), 5);
  EXPECT_FALSE(arch.contains({1.9, 2.4}));
  const CrossSection polygon =
      section("shape = \"polygon\"\nvertices_m = [[0, 0], [4, 0], [4, 2.0], [0, 3]]");
  EXPECT_DOUBLE_EQ(polygon.lowest().x(), -2);  // centred on the bounding box
  EXPECT_DOUBLE_EQ(polygon.highest().y(), 1.5);
}

TEST(Tunnel, FeaturesLeaveTheOriginWhereItIs) {
  const FlightTunnel tunnel = parse_tunnel(
      "name = \"bay\"\nlength_m = 10\nshape = \"square\"\nwidth_m = 2\n"
      "[[feature]]\nedge = 1\nfrom_m = 0.5\nto_m = 1.5\ninward_m = -0.5\n",
      "t.toml");
  EXPECT_DOUBLE_EQ(tunnel.section.highest().x(), 1.5);
  EXPECT_DOUBLE_EQ(tunnel.section.ray({0, -0.9}, {1, 0}), 1);
  EXPECT_DOUBLE_EQ(tunnel.section.ray({0, 0}, {1, 0}), 1.5);
}

TEST(Tunnel, ErrorsNameFileLineAndRule) {
  const std::string head = "name = \"t\"\nlength_m = 10\n";
  EXPECT_THAT(wrong("name = "), HasSubstr("t.toml:1:"));
  EXPECT_THAT(wrong(head), HasSubstr("shape is missing"));
  EXPECT_THAT(wrong(head + "shape = \"egg\""), AllOf(HasSubstr("t.toml:3:"), HasSubstr("egg")));
  EXPECT_THAT(wrong(head + "shape = 3"), HasSubstr("text in quotes"));
  EXPECT_THAT(wrong(head + "shape = \"square\"\nwidth_m = -1"),
              AllOf(HasSubstr("t.toml:4:"), HasSubstr("width_m")));
  EXPECT_THAT(wrong(head + "shape = \"square\"\nwidth_m = nan"), HasSubstr("width_m"));
  EXPECT_THAT(wrong(head + "shape = \"square\"\nwidth = 1"), HasSubstr("width is not a key"));
  EXPECT_THAT(wrong(head + "shape = \"arch\"\nwidth_m = 1\nheight_m = 1\nwall_height_m = 2"),
              HasSubstr("less than height_m"));
  EXPECT_THAT(wrong(head + "shape = \"polygon\"\nvertices_m = [[0, 0], [1, 0], [1]]"), HasSubstr("vertex 3"));
  EXPECT_THAT(wrong(head + "shape = \"polygon\"\nvertices_m = [[0, 0], [1, 1], [1, 0], [0, 1]]"),
              HasSubstr("cross"));
  const std::string square = head + "shape = \"square\"\nwidth_m = 2\n[[feature]]\n";
  EXPECT_THAT(wrong(square + "edge = 4\nfrom_m = 0.5\nto_m = 1\ninward_m = 0.1"), HasSubstr("edges 0 to 3"));
  EXPECT_THAT(wrong(square + "edge = 1\nfrom_m = 0.5\nto_m = 3\ninward_m = 0.1"),
              HasSubstr("within their edge"));
}

}  // namespace
}  // namespace tunnelrig
