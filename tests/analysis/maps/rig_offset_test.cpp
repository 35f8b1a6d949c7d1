// A constant offset of the rig is told from the field, by both methods.
#include "analysis/maps/rig_offset.h"

#include "analysis/maps/symmetric_kernel.h"
#include "analysis/maps/tunnel_maps.h"
#include "published_input.h"

#include <cmath>
#include <cstdint>

#include <Eigen/LU>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using test::published_input;

const std::vector<TunnelPoint> kPoints = {{0.05, 0.1}, {0.3, 0.7},  {0.999, -0.05}, {0.12, -0.987},
                                          {1, 1},      {0.5, -0.3}, {0.8, 0}};

/// A pair of rotors that is stronger everywhere: it adds the same to U on both sides of the tunnel.
MapInput with_offset(MapInput input, double percent) {
  for (LocationEstimate& location : input.locations) location.u_percent += percent;
  return input;
}

/// No uneven thrust anywhere, measured with the errors of `input`.
MapInput without_field(MapInput input) {
  for (LocationEstimate& location : input.locations)
    location.u_percent -= test::true_uneven_thrust_percent({location.y_norm, location.z_norm});
  return input;
}

class OffsetOfTheRig : public testing::TestWithParam<MapMethod> {
 protected:
  TunnelMaps fit(const MapInput& input) const { return fit_maps(input, {.method = GetParam()}); }
};
INSTANTIATE_TEST_SUITE_P(BothMethods, OffsetOfTheRig, testing::ValuesIn(test::kMethods),
                         [](const auto& method) {
                           return method.param == MapMethod::kGaussianProcess ? "GaussianProcess"
                                                                              : "ThinPlateSpline";
                         });

TEST_P(OffsetOfTheRig, AloneLeavesAMapThatIsFlatWithinItsUncertainty) {
  constexpr int kCampaigns = 25;
  int held = 0, flat = 0;
  for (std::uint64_t seed = 1; seed <= kCampaigns; ++seed) {
    const TunnelMaps maps = fit(with_offset(without_field(published_input(seed)), 1));
    const FieldEstimate offset = offset_of(maps.uneven_thrust).value();
    EXPECT_LT(offset.u95(), 0.1);  // 7 locations on the centre line, errors of 0.1
    held += std::abs(offset.value - 1) < offset.u95();
    for (const TunnelPoint& point : kPoints) {
      const FieldEstimate there = estimate_at(maps.uneven_thrust, point);
      EXPECT_LT(std::abs(there.value), 0.4);
      flat += std::abs(there.value) < there.u95();
    }
  }
  EXPECT_GE(held, kCampaigns - 4);  // binomial: fewer once in 140 times
  EXPECT_GE(flat, 0.85 * kCampaigns * static_cast<double>(kPoints.size()));
}

TEST_P(OffsetOfTheRig, ChangesNothingInTheMap) {
  const MapInput input = published_input(5);
  const TunnelMaps before = fit(input), after = fit(with_offset(input, -2.5));
  const FieldEstimate none = *offset_of(before.uneven_thrust), offset = *offset_of(after.uneven_thrust);
  EXPECT_NEAR(offset.value - none.value, -2.5, 1e-3);
  EXPECT_NEAR(offset.u95(), none.u95(), 1e-3);
  for (const TunnelPoint& point : kPoints) {
    const FieldEstimate a = estimate_at(before.uneven_thrust, point),
                        b = estimate_at(after.uneven_thrust, point);
    EXPECT_NEAR(a.value, b.value, 1e-3);
    EXPECT_NEAR(a.standard_uncertainty, b.standard_uncertainty, 1e-3);
  }
}

TEST_P(OffsetOfTheRig, IsFarBelowWhatTheFieldIsWhereThereIsNone) {
  const TunnelMaps maps = fit(published_input(6));
  const FieldEstimate offset = *offset_of(maps.uneven_thrust);
  EXPECT_LT(std::abs(offset.value), 0.12);
  EXPECT_LT(offset.u95(), 0.1);
  FieldData fixed = uneven_thrust_data(maps.input);
  fixed.offset_column.setZero();
  const FittedField field = GetParam() == MapMethod::kThinPlateSpline
                                ? FittedField(ThinPlateSpline(fixed))
                                : FittedField(GaussianProcess(fixed, fit_hyperparameters(fixed)));
  EXPECT_FALSE(offset_of(field));
  for (const TunnelPoint& point : kPoints) {
    const FieldEstimate with = estimate_at(maps.uneven_thrust, point), without = estimate_at(field, point);
    EXPECT_NEAR(with.value, without.value, 0.12);
    EXPECT_NEAR(with.standard_uncertainty, without.standard_uncertainty, 0.05);
  }
}

TEST_P(OffsetOfTheRig, CountsWithWhatAllLocationsAreDeclaredToShare) {
  const MapInput input = published_input(7, {.shared_u_percent = 0.5});
  const TunnelMaps maps = fit(input);
  EXPECT_GT(offset_of(maps.uneven_thrust)->standard_uncertainty, 0.5);
  for (const TunnelPoint& point : kPoints)
    EXPECT_LT(estimate_at(maps.uneven_thrust, point).standard_uncertainty, 0.4);
}

/// What the report ranks. The reduction's own U95 would be that of U with the offset and all that is shared.
TEST_P(OffsetOfTheRig, TakenOffTheMeasuredValuesLeavesTheFieldToItsU95) {
  constexpr int kCampaigns = 40;
  int held = 0, locations = 0;
  for (std::uint64_t seed = 1; seed <= kCampaigns; ++seed) {
    const MapInput input = with_offset(published_input(seed, {.shared_u_percent = 0.5}), 2.5);
    for (const MeasuredField& measured : measured_field(fit(input).uneven_thrust)) {
      const double error = measured.field.value - test::true_uneven_thrust_percent(measured.point);
      held += std::abs(error) <= measured.field.u95();
      EXPECT_LT(measured.field.u95(), 0.3) << "0.1 of its own; what all share is in the offset";
      EXPECT_GT(measured.point.y_norm, 0);
      ++locations;
    }
  }
  EXPECT_EQ(locations, 35 * kCampaigns);
  EXPECT_GT(held, 0.93 * locations);
  EXPECT_LT(held, 0.97 * locations);
}

TEST_P(OffsetOfTheRig, IsNoPartOfTheChangeOfThrust) {
  EXPECT_FALSE(offset_of(fit(published_input(1)).delta_ct));
}

TEST_P(OffsetOfTheRig, ThatNoLocationShowsCountsAsZero) {
  FieldData data = uneven_thrust_data(merge_locations(published_input(1)));
  for (Index i = data.size() - 1; i >= 0; --i) {
    if (data.points[static_cast<std::size_t>(i)].y_norm == 0) data = without(data, i);
  }
  EXPECT_FALSE(column_of_offset(data).any());
  const FittedField field =
      GetParam() == MapMethod::kThinPlateSpline
          ? FittedField(ThinPlateSpline(data))
          : FittedField(GaussianProcess(data, {.amplitude_percent = 2, .excess_percent = 0.1}));
  EXPECT_FALSE(offset_of(field));
  EXPECT_TRUE(std::isfinite(estimate_at(field, {0.5, 0.5}).standard_uncertainty));
}

/// Locations of both halves: the mirror images of some, with errors of their own.
MapInput on_both_sides(std::uint64_t seed) {
  MapInput input = test::only(published_input(seed, {.independent_percent = 0.1, .shared_u_percent = 0.3}),
                              {"OT", "H2V1", "H3V-2", "H4V2", "H5V0"});
  const MapInput others = test::only(published_input(seed + 1), {"H2V1", "H3V-2", "H4V2"});
  const auto n = static_cast<Index>(input.locations.size());
  for (LocationEstimate location : others.locations) {
    location.label.insert(1, "-");
    location.y_norm = -location.y_norm;
    location.u_percent = -location.u_percent;
    input.locations.push_back(location);
  }
  const auto all = static_cast<Index>(input.locations.size());
  const MatrixXd u = input.u_covariance, c_t = input.c_t_covariance;
  input.u_covariance = MatrixXd::Constant(all, all, 0.09) + 0.01 * MatrixXd::Identity(all, all);
  for (Index i = n; i < all; ++i) input.u_covariance(i, i) *= 1 + 0.5 * static_cast<double>(i - n);
  input.c_t_covariance = c_t(0, 0) * MatrixXd::Identity(all, all);
  return input;
}

/// Field and offset, given all measured values as they are: no image is merged, and β is a parameter with an
/// all but flat prior.
FieldEstimate by_joint_prior(const MapInput& input, const Hyperparameters& h, const TunnelPoint& point,
                             double share_of_field, double share_of_offset) {
  constexpr double kFlat = 1e6;
  const auto base = [&h](double dy, double dz) { return matern(h, dy, dz)(0); };
  const auto n = static_cast<Index>(input.locations.size());
  MatrixXd covariance = input.u_covariance + MatrixXd::Constant(n, n, kFlat);
  VectorXd values(n), with(n);
  const auto place = [&](Index i) {
    const LocationEstimate& location = input.locations[static_cast<std::size_t>(i)];
    return TunnelPoint{location.y_norm, location.z_norm};
  };
  for (Index i = 0; i < n; ++i) {
    values(i) = input.locations[static_cast<std::size_t>(i)].u_percent;
    with(i) = share_of_field * anchored(base, Parity::kOdd, point, place(i)) + share_of_offset * kFlat;
    for (Index j = 0; j < n; ++j) covariance(i, j) += anchored(base, Parity::kOdd, place(i), place(j));
  }
  const VectorXd weights = covariance.fullPivLu().solve(with);
  const double prior = share_of_field * anchored(base, Parity::kOdd, point, point) + share_of_offset * kFlat;
  return {weights.dot(values), std::sqrt(prior - weights.dot(with))};
}

TEST(MirrorImages, ShowTheOffsetAsACentreLineDoes) {
  const Hyperparameters h{.amplitude_percent = 2, .length_y = 0.9, .length_z = 0.7};
  const MapInput input = with_offset(on_both_sides(3), 1.5);
  const GaussianProcess process(uneven_thrust_data(merge_locations(input)), h);
  const FieldEstimate offset = process.offset().value(), joint = by_joint_prior(input, h, {}, 0, 1);
  EXPECT_NEAR(offset.value, joint.value, 1e-4);
  EXPECT_NEAR(offset.standard_uncertainty, joint.standard_uncertainty, 1e-4);
  EXPECT_NEAR(offset.value, 1.5, offset.u95());
  for (const TunnelPoint& point : kPoints) {
    const FieldEstimate there = process.at(point), expected = by_joint_prior(input, h, point, 1, 0);
    EXPECT_NEAR(there.value, expected.value, 1e-4);
    EXPECT_NEAR(there.standard_uncertainty, expected.standard_uncertainty, 1e-4);
  }
}

TEST(MirrorImages, ShowASplineItsOffset) {
  const FieldData data = uneven_thrust_data(merge_locations(with_offset(on_both_sides(3), 1.5)));
  EXPECT_EQ(data.labels.back(), "mirror images");
  const ThinPlateSpline spline(data);
  EXPECT_NEAR(spline.offset()->value, 1.5, 0.8);
  // Less than OT alone would leave: of the shared 0.3 nothing can be had, of the 0.1 three pairs and OT.
  EXPECT_LT(spline.offset()->standard_uncertainty, std::sqrt(0.09 + 0.01 / 3));
  EXPECT_EQ(spline.at({0, 0.5}).value, 0);
}

}  // namespace
}  // namespace tunnelrig
