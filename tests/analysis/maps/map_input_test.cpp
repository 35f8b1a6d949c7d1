#include "analysis/maps/map_input.h"

#include "analysis/maps/field_data.h"
#include "calibration/distributions.h"
#include "published_input.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/LU>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using test::exact_input;
using test::message_of;
using test::only;
using test::published_input;
using testing::HasSubstr;

std::string refusal(const MapInput& input) {
  return message_of([&] { merge_locations(input); });
}

/// The input with one more location, independent of the others.
MapInput with(const MapInput& input, const LocationEstimate& location, double c_t_std, double u_std) {
  MapInput more = input;
  more.locations.push_back(location);
  const auto n = static_cast<Index>(more.locations.size());
  more.c_t_covariance.conservativeResizeLike(MatrixXd::Zero(n, n));
  more.u_covariance.conservativeResizeLike(MatrixXd::Zero(n, n));
  more.c_t_covariance(n - 1, n - 1) = c_t_std * c_t_std;
  more.u_covariance(n - 1, n - 1) = u_std * u_std;
  return more;
}

TEST(MapInput, RefusesTooFewLocationsAndSaysHowManyThereAre) {
  const MapInput input = published_input(1);
  EXPECT_THAT(refusal(only(input, {"OT", "H4V-2"})), HasSubstr("map: 2 locations make no map; at least 4"));
  EXPECT_THAT(refusal(only(input, {"OT"})), HasSubstr("1 location makes no map"));
  MapInput mirrored = only(input, {"OT", "H4V-2", "H2V1"});
  LocationEstimate image = mirrored.locations[1];
  image.label = "left";
  image.y_norm = -image.y_norm;
  EXPECT_THAT(refusal(with(mirrored, image, 1e-4, 0.1)), HasSubstr("3 locations make no map"));
}

TEST(MapInput, RefusesLocationsOnALineAndSaysWhichAreMissing) {
  const MapInput input = published_input(1);
  EXPECT_THAT(
      refusal(only(input, {"OT", "H0V1", "H0V2", "H0V-1", "H0V-3"})),
      HasSubstr("all 5 locations are on one line; measure at other positions across the tunnel (y_norm)"));
  EXPECT_THAT(refusal(only(input, {"OT", "H1V0", "H3V0", "H5V0"})), HasSubstr("at other heights (z_norm)"));
  MapInput diagonal = only(input, {"OT", "H1V1", "H2V2", "H3V3"});
  for (LocationEstimate& location : diagonal.locations) location.z_norm = location.y_norm;
  EXPECT_THAT(refusal(diagonal), HasSubstr("beside that diagonal"));
}

TEST(MapInput, RefusesAMapWithoutItsReference) {
  EXPECT_THAT(refusal(only(published_input(1), {"H0V1", "H1V0", "H2V2", "H3V-1"})),
              HasSubstr("no run at OT"));
}

TEST(MapInput, RefusesImpossibleLocations) {
  MapInput input = published_input(1);
  input.locations[9].y_norm = 1.2;
  EXPECT_THAT(refusal(input), HasSubstr("location H1V1 is at (1.2, 0.32); normalised coordinates"));
  input = published_input(1);
  input.locations[9].z_norm = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(refusal(input), HasSubstr("location H1V1 is at"));
  input = published_input(1);
  input.locations[9].c_t = 0;
  EXPECT_THAT(refusal(input), HasSubstr("location H1V1 has C_T = 0; it must be above 0"));
  input = published_input(1);
  input.locations[9].u_percent = std::numeric_limits<double>::infinity();
  EXPECT_THAT(refusal(input), HasSubstr("location H1V1 has U = inf %"));
  input = published_input(1);
  input.locations[9].label = "H0V0";
  EXPECT_THAT(refusal(input), HasSubstr("stands at two positions"));
}

TEST(MapInput, RefusesImpossibleCovariances) {
  MapInput input = published_input(1);
  input.c_t_covariance(3, 4) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(refusal(input), HasSubstr("the covariance of C_T holds a value that is not finite"));
  input = published_input(1);
  input.u_covariance(3, 4) = 0.005;
  EXPECT_THAT(refusal(input), HasSubstr("the covariance of U is not symmetric"));
  input = published_input(1);
  input.u_covariance(3, 4) = input.u_covariance(4, 3) = 0.02;
  EXPECT_THAT(refusal(input), HasSubstr("the covariance of U is indefinite"));
  input = published_input(1);
  input.c_t_covariance = MatrixXd::Identity(3, 3);
  EXPECT_THAT(refusal(input), HasSubstr("the covariance of C_T is 3 × 3 for 42 locations"));
}

TEST(MapInput, RefusesAVehicleThatDoesNotFit) {
  MapInput input = published_input(1);
  input.geometry.vehicle_width_m = 1.6;
  EXPECT_THAT(refusal(input), HasSubstr("does not fit a tunnel of 1.5 m × 1.5 m"));
  input.geometry.vehicle_width_m = 0;
  EXPECT_THAT(refusal(input), HasSubstr("rig.vehicle_width_m of campaign.toml is missing or 0"));
  input.geometry.vehicle_height_m = -1;
  input.geometry.vehicle_width_m = 0.7;
  EXPECT_THAT(refusal(input), HasSubstr("rig.vehicle_height_m of campaign.toml is -1 m"));
}

TEST(MapInput, OriginUnderBothNamesIsOneLocation) {
  const MapInput once = exact_input();
  LocationEstimate again = once.locations[3];
  ASSERT_EQ(again.label, "OT");
  again.label = "H0V0";
  again.c_t *= 1.003;
  again.u_percent = 0.5;
  const double std = std::sqrt(once.c_t_covariance(3, 3));
  const MapInput merged = merge_locations(with(once, again, 2 * std, 0.2));
  ASSERT_EQ(merged.locations.size(), 42u);
  // weights 4/5 and 1/5, from variances 1 and 4
  EXPECT_EQ(merged.locations[3].label, "OT");
  EXPECT_NEAR(merged.locations[3].c_t, once.locations[3].c_t * (1 + 0.003 / 5), 1e-12);
  EXPECT_NEAR(merged.locations[3].u_percent, 0.1, 1e-9);
  EXPECT_NEAR(merged.c_t_covariance(3, 3), 0.8 * std * std, 1e-15);
}

TEST(MapInput, MergingIsGeneralisedLeastSquares) {
  // Two estimates of one location and a third one that shares its error with the first: what the first is
  // moved by, moves the third as well. Reference: x̂ = (AᵀΣ⁻¹A)⁻¹AᵀΣ⁻¹x.
  MapInput input = only(exact_input(), {"OT", "H0V0", "H2V2", "H3V-1", "H4V1"});
  LocationEstimate again = input.locations[0];
  again.label = "H0V0";
  again.c_t += 3e-4;
  input = with(input, again, 2e-4, 0.1);
  input.c_t_covariance(0, 2) = input.c_t_covariance(2, 0) = 0.6 * input.c_t_covariance(0, 0);
  MatrixXd design = MatrixXd::Zero(5, 4);
  for (Index i = 0; i < 4; ++i) design(i, i) = 1;
  design(4, 0) = 1;
  Eigen::VectorXd c_t(5);
  for (Index i = 0; i < 5; ++i) c_t(i) = input.locations[static_cast<std::size_t>(i)].c_t;
  const MatrixXd information = design.transpose() * input.c_t_covariance.inverse() * design;
  const Eigen::VectorXd expected =
      information.inverse() * (design.transpose() * input.c_t_covariance.inverse() * c_t);

  const MapInput merged = merge_locations(input);
  ASSERT_EQ(merged.locations.size(), 4u);
  for (Index i = 0; i < 4; ++i) {
    EXPECT_NEAR(merged.locations[static_cast<std::size_t>(i)].c_t, expected(i), 1e-12) << i;
  }
  EXPECT_TRUE(merged.c_t_covariance.isApprox(information.inverse(), 1e-9));
}

TEST(MapInput, RefusesContradictionsThatTheCovarianceExcludes) {
  MapInput input = exact_input({.independent_percent = 0});
  LocationEstimate again = input.locations[3];
  again.label = "H0V0";
  again.c_t *= 1.01;
  EXPECT_THAT(refusal(with(input, again, 0, 0)), HasSubstr("estimates of C_T at one position differ"));
  LocationEstimate image = input.locations[12];
  image.label = "left";
  image.y_norm = -image.y_norm;
  image.u_percent = 3;
  const MapInput merged = merge_locations(with(input, image, 0, 0));
  EXPECT_THAT(message_of([&] { uneven_thrust_data(merged); }), HasSubstr("mirror images differ"));
}

TEST(FieldData, DeltaMethodAgreesWithSimulation) {
  const MapInput input = published_input(5, {.independent_percent = 0.2, .shared_gain_percent = 1});
  const FieldData data = thrust_change_data(merge_locations(input));
  ASSERT_EQ(data.size(), 41);  // OT is the reference
  const auto of = [&](const char* label) {
    return std::find(data.labels.begin(), data.labels.end(), label) - data.labels.begin();
  };
  const Index a = of("H4V2"), b = of("H1V-1");
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  Eigen::Matrix2d squares = Eigen::Matrix2d::Zero();
  constexpr int kCampaigns = 20000;
  for (int seed = 1; seed <= kCampaigns; ++seed) {
    const MapInput one = published_input(static_cast<std::uint64_t>(seed),
                                         {.independent_percent = 0.2, .shared_gain_percent = 1});
    const auto delta = [&](Index i) {  // OT stands at 3 among the 42
      return 100 *
             (one.locations[static_cast<std::size_t>(i < 3 ? i : i + 1)].c_t / one.locations[3].c_t - 1);
    };
    const Eigen::Vector2d deltas(delta(a), delta(b));
    mean += deltas / kCampaigns;
    squares += deltas * deltas.transpose() / kCampaigns;
  }
  const Eigen::Matrix2d covariance = squares - mean * mean.transpose();
  EXPECT_NEAR(data.covariance(a, a), covariance(0, 0), 0.05 * covariance(0, 0));
  EXPECT_NEAR(data.covariance(b, b), covariance(1, 1), 0.05 * covariance(1, 1));
  EXPECT_NEAR(data.covariance(a, b), covariance(0, 1), 0.05 * covariance(0, 0));
}

TEST(FieldData, AGainSharedByAllLocationsDoesNotReachTheChangeOfThrust) {
  const FieldData alone = thrust_change_data(merge_locations(exact_input()));
  const FieldData shared = thrust_change_data(merge_locations(exact_input({.shared_gain_percent = 3})));
  EXPECT_TRUE(shared.values.isApprox(alone.values, 1e-12));
  EXPECT_TRUE(shared.covariance.isApprox(alone.covariance, 1e-9));
}

TEST(FieldData, TheErrorOfTheReferenceIsSharedByAll) {
  MapInput input = exact_input({.independent_percent = 0});
  input.c_t_covariance(3, 3) = std::pow(0.002 * input.locations[3].c_t, 2);
  const FieldData data = thrust_change_data(merge_locations(input));
  EXPECT_NEAR(data.covariance(0, 0), 0.04, 0.004);  // (0.2 %)²
  EXPECT_NEAR(data.covariance(7, 30) / std::sqrt(data.covariance(7, 7) * data.covariance(30, 30)), 1, 1e-9);
}

/// U of one source with 1 degree of freedom beside independent errors that are known.
MapInput with_shared_u_of_one_dof() {
  MapInput input = exact_input({.independent_percent = 0.05, .shared_u_percent = 0.1});
  const auto n = static_cast<Index>(input.locations.size());
  input.u_over_root_dof = {MatrixXd::Constant(n, n, 0.01)};
  return input;
}

TEST(FieldData, MeasuredLocationsAreExpandedByStudentsT) {
  const MapInput merged = merge_locations(with_shared_u_of_one_dof());
  const double u = std::hypot(0.05, 0.1), dof = std::pow(u, 4) / 1e-4;  // Welch–Satterthwaite: 1.56
  for (const MeasuredLocation& location : measured_locations(merged)) {
    EXPECT_NEAR(location.uneven_thrust_u95_percent, student_t_quantile(0.975, dof) * u, 1e-9);
    if (location.label != "OT") {
      EXPECT_NEAR(location.delta_ct_u95_percent, 1.96 * 0.05 * std::sqrt(2), 0.01) << "known exactly";
    }
  }
}

TEST(FieldData, DegreesOfFreedomComeThroughMergingAndMirroring) {
  MapInput input = with_shared_u_of_one_dof();
  LocationEstimate image = input.locations[12];
  image.label = "left";
  image.y_norm = -image.y_norm;
  image.u_percent = -image.u_percent;
  MapInput more = with(input, image, 1e-4, 0.1);
  const auto n = static_cast<Index>(more.locations.size());
  more.u_over_root_dof[0].conservativeResizeLike(MatrixXd::Zero(n, n));
  const FieldData data = uneven_thrust_data(merge_locations(more));
  ASSERT_EQ(data.over_root_dof.size(), 1u);
  // Of the two the share of the one is 0.1² / (0.05² + 0.1² + 0.1²): the better known weighs more.
  const double share = 0.01 / (0.0025 + 0.01 + 0.01);
  EXPECT_NEAR(data.over_root_dof[0](12, 12), 0.01 * share * share, 1e-9);
  // What the two differ by tells of the shared error, so that the others are better known as well.
  EXPECT_NEAR(data.over_root_dof[0](3, 5), 0.01 * (1 - share) * (1 - share), 1e-9);
}

TEST(FieldData, MirrorImagesAreOneObservation) {
  const MapInput input = exact_input();
  LocationEstimate image = input.locations[12];
  image.label = "left";
  image.y_norm = -image.y_norm;
  image.u_percent = -image.u_percent - 0.3;
  const MapInput merged = merge_locations(with(input, image, 1e-4, 0.1));
  ASSERT_EQ(merged.locations.size(), 43u);
  const FieldData data = uneven_thrust_data(merged);
  ASSERT_EQ(data.size(), 43);
  EXPECT_NEAR(data.values(12), input.locations[12].u_percent + 0.15, 1e-9);
  EXPECT_NEAR(data.offset_column(12), 0, 1e-12);
  // And half their sum is one of the rig's offset.
  EXPECT_EQ(data.points[42].y_norm, 0);
  EXPECT_NEAR(data.values(42), -0.15, 1e-9);
  EXPECT_NEAR(data.covariance(42, 42), 0.1 * 0.1 / 2, 1e-12);
  EXPECT_NEAR(data.covariance(42, 12), 0, 1e-12);
  EXPECT_NEAR(data.offset_column(42), 1, 1e-12);
  EXPECT_EQ(measured_locations(merged)[42].y_norm, image.y_norm);
}

}  // namespace
}  // namespace tunnelrig
