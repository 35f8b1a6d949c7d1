#include "analysis/maps/disturbance_map.h"

#include "analysis/maps/tunnel_maps.h"
#include "datasets/csv.h"
#include "published_input.h"
#include "support/temporary_folder.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

using test::message_of;
using testing::HasSubstr;

DisturbanceMap example() {
  return disturbance_map(fit_maps(test::published_input(1)), 5,
                         R"({"program":"test","arguments":["map","--out"]})");
}

/// The message for the example with one piece of its text replaced.
std::string refusal(const std::string& piece, const std::string& by) {
  std::string text = format_disturbance_map(example());
  const auto at = text.find(piece);
  if (at == std::string::npos) return "the example does not hold " + piece;
  text.replace(at, piece.size(), by);
  return message_of([&] { parse_disturbance_map(text, "m.json"); });
}

TEST(DisturbanceMap, ComesBackAsItWas) {
  const DisturbanceMap map = example();
  const std::string text = format_disturbance_map(map);
  const DisturbanceMap back = parse_disturbance_map(text, "m.json");
  EXPECT_EQ(format_disturbance_map(back), text);
  EXPECT_EQ(back.grid.y_norm, map.grid.y_norm);
  EXPECT_EQ(back.delta_ct.value_percent, map.delta_ct.value_percent);
  EXPECT_EQ(back.delta_ct.u95_percent, map.delta_ct.u95_percent);
  EXPECT_EQ(back.uneven_thrust.value_percent, map.uneven_thrust.value_percent);
  EXPECT_EQ(back.uneven_thrust.u95_percent, map.uneven_thrust.u95_percent);
  EXPECT_EQ(back.geometry.vehicle_width_m, 0.7434);
  EXPECT_EQ(back.geometry.propeller_radius_m, 0.1524);
  ASSERT_EQ(back.locations.size(), 42u);
  EXPECT_EQ(back.locations[41].label, map.locations[41].label);
  EXPECT_EQ(back.locations[41].uneven_thrust_percent, map.locations[41].uneven_thrust_percent);
  EXPECT_EQ(back.method, "gaussian-process");
  EXPECT_EQ(back.c_t_origin, map.c_t_origin);
  EXPECT_EQ(back.c_t_open_space, 0.1056);
  EXPECT_EQ(back.delta_ct_fit.hyperparameters, map.delta_ct_fit.hyperparameters);
  EXPECT_EQ(back.delta_ct_fit.leave_one_out.locations, 41);
  EXPECT_EQ(back.uneven_thrust_fit.leave_one_out.standardised_rms,
            map.uneven_thrust_fit.leave_one_out.standardised_rms);
  ASSERT_TRUE(back.uneven_thrust_fit.offset);
  EXPECT_EQ(back.uneven_thrust_fit.offset->value_percent, map.uneven_thrust_fit.offset->value_percent);
  EXPECT_EQ(back.uneven_thrust_fit.offset->u95_percent, map.uneven_thrust_fit.offset->u95_percent);
  EXPECT_FALSE(back.delta_ct_fit.offset);
  EXPECT_EQ(back.provenance, map.provenance);
}

TEST(DisturbanceMap, NeedsNoOffset) {
  DisturbanceMap map = example();
  map.uneven_thrust_fit.offset.reset();
  EXPECT_FALSE(parse_disturbance_map(format_disturbance_map(map), "m.json").uneven_thrust_fit.offset);
}

TEST(DisturbanceMap, AnOffsetIsSignificantBeyondAKnownUncertainty) {
  EXPECT_TRUE((RigOffset{-1, 0.5}.significant()));
  EXPECT_FALSE((RigOffset{0.4, 0.5}.significant()));
  EXPECT_FALSE((RigOffset{1, std::nan("")}.significant()));
}

TEST(DisturbanceMap, WhatIsNotKnownIsNull) {
  DisturbanceMap map = example();
  map.delta_ct.u95_percent.assign(map.grid.nodes(), std::nan(""));
  map.locations[3].delta_ct_u95_percent = std::nan("");
  const std::string text = format_disturbance_map(map);
  EXPECT_THAT(text, HasSubstr("\"delta_ct_u95_percent\": [\n [null,null,null,null,null]"));
  const DisturbanceMap back = parse_disturbance_map(text, "m.json");
  EXPECT_FALSE(back.delta_ct.u95_known());
  EXPECT_TRUE(back.uneven_thrust.u95_known());
  EXPECT_TRUE(std::isnan(back.locations[3].delta_ct_u95_percent));
  EXPECT_EQ(format_disturbance_map(back), text);
  EXPECT_THAT(refusal("\"delta_ct_percent\": [\n [", "\"delta_ct_percent\": [\n [null,"),
              HasSubstr("delta_ct_percent"))
      << "a value is always known";
}

TEST(DisturbanceMap, RowsAreHeightsAndColumnsGoAcross) {
  const DisturbanceMap map = example();
  const TunnelMaps maps = fit_maps(test::published_input(1));
  EXPECT_NEAR(map.delta_ct.value_percent[map.grid.index(4, 3)], estimate_at(maps.delta_ct, {0.5, 1}).value,
              1e-6);
}

TEST(DisturbanceMap, AReferenceInOpenSpaceMayBeMissing) {
  DisturbanceMap map = example();
  map.c_t_open_space.reset();
  EXPECT_FALSE(parse_disturbance_map(format_disturbance_map(map), "m.json").c_t_open_space);
}

TEST(DisturbanceMap, NamesTheKeyThatIsWrong) {
  EXPECT_THAT(refusal("{", "["), HasSubstr("m.json: is not a disturbance map"));
  EXPECT_THAT(refusal("tunnelrig-map/1", "tunnelrig-map/9"),
              HasSubstr("the key format is 'tunnelrig-map/9'"));
  EXPECT_THAT(refusal("\"format\"", "\"fromat\""), HasSubstr("the key format is missing"));
  EXPECT_THAT(refusal("\"vehicle_width_m\":0.7434", "\"vehicle_width_m\":1.7434"),
              HasSubstr("the key geometry.vehicle_width_m (1.7434 m) must be below tunnel_width_m"));
  EXPECT_THAT(refusal("\"vehicle_height_m\":0.3", "\"vehicle_height_m\":\"0.3\""),
              HasSubstr("the key geometry.vehicle_height_m must be a number"));
  EXPECT_THAT(refusal("\"tunnel_height_m\":1.5", "\"tunnel_height_m\":0"),
              HasSubstr("the key geometry.tunnel_height_m must be above 0, is 0"));
  EXPECT_THAT(refusal("\"propeller_radius_m\":", "\"radius\":"),
              HasSubstr("the key geometry.propeller_radius_m is missing"));
  EXPECT_THAT(refusal("\"geometry\": {", "\"geometry\": 1, \"rest\": {"),
              HasSubstr("the key geometry must be an object"));
  EXPECT_THAT(refusal("\"coverage_factor\": 1.96", "\"coverage_factor\": 1e999"), HasSubstr("m.json"));
  EXPECT_THAT(refusal("\"label\":\"H0V3\"", "\"label\":3"),
              HasSubstr("the key locations[0].label must be a string"));
  EXPECT_THAT(refusal("\"y_norm\":0.0", "\"y_norm\":7"),
              HasSubstr("the key locations[0].y_norm must be within"));
  EXPECT_THAT(refusal("\"locations\":41", "\"locations\":-41"),
              HasSubstr("the key fits.delta_ct.leave_one_out.locations must be a whole number"));
  EXPECT_THAT(refusal("\"length_y\":", "\"length_y\":null,\"other\":"),
              HasSubstr("the key fits.delta_ct.hyperparameters.length_y must be a number"));
  EXPECT_THAT(refusal("\"provenance\": {", "\"provenance\": [], \"rest\": {"),
              HasSubstr("the key provenance must be an object"));
}

TEST(DisturbanceMap, NamesTheGridThatIsWrong) {
  const std::string y_axis = "\"y_norm\": [-1.0,-0.5,0.0,0.5,1.0]";
  EXPECT_THAT(refusal(y_axis, "\"y_norm\": [-1.0,-0.5,0.0,0.5]"),
              HasSubstr("the key y_norm must run from -1 to 1"));
  EXPECT_THAT(refusal(y_axis, "\"y_norm\": []"), HasSubstr("the key y_norm must run from -1 to 1"));
  EXPECT_THAT(refusal(y_axis, "\"y_norm\": [-1.0,0.0,-0.5,0.5,1.0]"),
              HasSubstr("the key y_norm[2] must be above the one before it"));
  EXPECT_THAT(refusal(y_axis, "\"y_norm\": [-1.0,-0.5,0.1,0.5,1.0]"),
              HasSubstr("the key y_norm must hold a 0"));
  EXPECT_THAT(refusal(y_axis, "\"y_norm\": [-1.0,0.0,1.0]"),
              HasSubstr("the key delta_ct_percent[0] has 5 values where y_norm has 3"));
  EXPECT_THAT(refusal("\"z_norm\": [-1.0,-0.5,0.0,0.5,1.0]", "\"z_norm\": [-1.0,0.0,1.0]"),
              HasSubstr("the key delta_ct_percent has 5 rows where z_norm has 3 values"));
  EXPECT_THAT(refusal("\"delta_ct_u95_percent\": [\n [", "\"delta_ct_u95_percent\": [\n [-"),
              HasSubstr("the key delta_ct_u95_percent must not hold a negative value"));
  EXPECT_THAT(refusal("\"uneven_thrust_percent\": [\n [", "\"uneven_thrust_percent\": [\n [null,"),
              HasSubstr("the key uneven_thrust_percent[0]"));
  DisturbanceMap map = example();
  map.delta_ct.value_percent[map.grid.index(2, 2)] = 0.1;
  EXPECT_THAT(message_of([&] { parse_disturbance_map(format_disturbance_map(map), "m.json"); }),
              HasSubstr("the key delta_ct_percent must be 0 at y_norm = z_norm = 0, is 0.1"));
}

/// The message for the example with one value of a layer replaced.
std::string refusal_of_value(MapLayer DisturbanceMap::*layer, std::size_t row, std::size_t column,
                             double value) {
  DisturbanceMap map = example();
  (map.*layer).value_percent[map.grid.index(row, column)] = value;
  return message_of([&] { parse_disturbance_map(format_disturbance_map(map), "m.json"); });
}

TEST(DisturbanceMap, NamesTheThrustThatNoRotorHas) {
  EXPECT_THAT(refusal_of_value(&DisturbanceMap::uneven_thrust, 1, 3, 500),
              HasSubstr("m.json: the key uneven_thrust_percent must be from -100 to 100 %, holds 500"));
  EXPECT_THAT(refusal_of_value(&DisturbanceMap::delta_ct, 1, 3, -101),
              HasSubstr("m.json: the key delta_ct_percent must not be below -100 %, holds -101"));
  EXPECT_THAT(refusal_of_value(&DisturbanceMap::delta_ct, 1, 3, 1e308),
              HasSubstr("m.json: the key delta_ct_percent must not be above 1000 %, holds 1e+308"));
}

TEST(DisturbanceMap, NamesTheNodeThatIsNotTheMirrorImage) {
  EXPECT_THAT(refusal_of_value(&DisturbanceMap::uneven_thrust, 1, 3, 7.5),
              HasSubstr("m.json: the key uneven_thrust_percent[1][1] must be odd in y_norm, is "));
  EXPECT_THAT(
      refusal_of_value(&DisturbanceMap::uneven_thrust, 4, 2, 0.3),
      HasSubstr("the key uneven_thrust_percent[4][2] must be odd in y_norm, is 0.3 at 0 and 0.3 at 0"));
  EXPECT_THAT(refusal_of_value(&DisturbanceMap::delta_ct, 0, 4, 50),
              HasSubstr("the key delta_ct_percent[0][0] must be even in y_norm, is "));
  DisturbanceMap rounded = example();  // another program's: to 0.001, and a column without a mirror image
  for (MapLayer* layer : {&rounded.delta_ct, &rounded.uneven_thrust}) {
    for (double& value : layer->value_percent) value = std::floor(1000 * value) / 1000;
  }
  rounded.grid.y_norm[1] = -0.7;
  EXPECT_NO_THROW(parse_disturbance_map(format_disturbance_map(rounded), "m.json"));
}

TEST(DisturbanceMap, WhatMapWritesIsRead) {
  for (const MapMethod method : {MapMethod::kGaussianProcess, MapMethod::kThinPlateSpline}) {
    for (const unsigned seed : {1U, 2U, 3U}) {
      const TunnelMaps maps = fit_maps(test::published_input(seed), {.method = method});
      for (const int nodes : {3, 7, 41}) {
        const std::string text = format_disturbance_map(disturbance_map(maps, nodes, "{}"));
        EXPECT_NO_THROW(parse_disturbance_map(text, "m.json")) << nodes << " nodes";
      }
    }
  }
}

TEST(DisturbanceMap, IsReadFromAFile) {
  const test::TemporaryFolder folder;
  write_text(folder / "m.json", format_disturbance_map(example()));
  EXPECT_EQ(read_disturbance_map(folder / "m.json").locations.size(), 42u);
  EXPECT_THAT(message_of([&] { read_disturbance_map(folder / "none.json"); }),
              HasSubstr("none.json: cannot be read"));
}

}  // namespace
}  // namespace tunnelrig
