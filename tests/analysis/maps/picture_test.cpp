#include "analysis/maps/picture.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

using testing::HasSubstr;
using testing::Not;

/// A closed square around a place on the right, of which its corner names itself in the script.
ContourLine square(double y_norm, double side) {
  const TunnelPoint corner{y_norm, 0.25};
  return {
      .level = 0.1,
      .points = {corner, {y_norm + side, 0.25}, {y_norm + side, 0.25 + side}, {y_norm, 0.25 + side}, corner}};
}

Picture picture(bool diverging) {
  return {.title = "title",
          .note = "note",
          .colour_label = "U_{95}(U) (%)",
          .diverging = diverging,
          .grid = {.y_norm = {-1, 0, 1}, .z_norm = {-1, 0, 1}},
          .values = std::vector<double>(9, 0.5),
          .lines = {square(0.375, 0.1), square(0.5, 0.4)},
          .locations = {{0, 0}, {0.5, 0.5}},
          .geometry = {.vehicle_width_m = 0.75,
                       .vehicle_height_m = 0.3,
                       .tunnel_width_m = 1.5,
                       .tunnel_height_m = 1.5,
                       .propeller_radius_m = 0.15}};
}

constexpr const char* kSpeck = "0.37500 0.25000\n";
constexpr const char* kLoop = "0.50000 0.25000\n";

TEST(Picture, UncertaintyIsDrawnWithoutTheSpecksAroundSingleLocations) {
  const std::string script = gnuplot_script(picture(false), "u95");
  EXPECT_THAT(script, Not(HasSubstr(kSpeck)));
  EXPECT_THAT(script, HasSubstr(kLoop));
}

TEST(Picture, ValuesAreDrawnWithAllTheirLines) {
  const std::string script = gnuplot_script(picture(true), "delta_ct");
  EXPECT_THAT(script, HasSubstr(kSpeck)) << "a small peak is one";
  EXPECT_THAT(script, HasSubstr(kLoop));
}

TEST(Picture, LongNumbersBesideTheColoursHaveRoomOfTheirOwn) {
  Picture quiet = picture(true);
  EXPECT_THAT(gnuplot_script(quiet, "u"), HasSubstr("size 1100,960"));
  quiet.values.assign(9, 0.0042);  // −0.005 to 0.005
  EXPECT_EQ(bar_letters(quiet), 6);
  EXPECT_THAT(gnuplot_script(quiet, "u"), HasSubstr("size 1116,960"));
  quiet.values.assign(9, 4.2e-6);
  EXPECT_EQ(bar_letters(quiet), 9);
  EXPECT_THAT(gnuplot_script(quiet, "u"), HasSubstr("set format cb '%.6f'"));
}

}  // namespace
}  // namespace tunnelrig
