// The same assertions over both methods and both fields.
#include "analysis/maps/symmetric_kernel.h"
#include "analysis/maps/tunnel_maps.h"
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
using Eigen::VectorXd;
using test::message_of;
using test::published_input;
using testing::HasSubstr;

/// Best linear unbiased prediction with one free coefficient β, written out as the system with a Lagrange
/// multiplier (Cressie 1993, *Statistics for Spatial Data*, 3.4): [K h; hᵀ 0] [w; m] = [k; h_x].
struct UniversalKriging {
  MatrixXd covariance;
  VectorXd values, column;  // of β; zeros: there is no β

  /// What is predicted has the covariance `with_data` with the values and holds `share` β.
  FieldEstimate predict(const VectorXd& with_data, double variance, double share) const {
    const Index n = values.size(), m = column.any() ? n + 1 : n;
    MatrixXd system = MatrixXd::Zero(m, m);
    VectorXd right = VectorXd::Zero(m);
    system.topLeftCorner(n, n) = covariance;
    right.head(n) = with_data;
    if (m > n) {
      system.col(n).head(n) = column;
      system.row(n).head(n) = column.transpose();
      right(n) = share;
    }
    const VectorXd solved = system.fullPivLu().solve(right);
    return {solved.head(n).dot(values), std::sqrt(variance - solved.dot(right))};
  }
};

const std::vector<TunnelPoint> kPoints = {{0.3, 0.7}, {0.999, -0.05}, {0.123456, -0.987}, {1, 1}, {0.5, 0}};

class Field : public testing::TestWithParam<MapMethod> {
 protected:
  TunnelMaps fit(const MapInput& input) const { return fit_maps(input, {.method = GetParam()}); }
};
INSTANTIATE_TEST_SUITE_P(BothMethods, Field, testing::ValuesIn(test::kMethods), [](const auto& method) {
  return method.param == MapMethod::kGaussianProcess ? "GaussianProcess" : "ThinPlateSpline";
});

TEST_P(Field, IsExactlySymmetric) {
  const TunnelMaps maps = fit(published_input(1));
  for (const TunnelPoint& point : kPoints) {
    const TunnelPoint image{-point.y_norm, point.z_norm};
    EXPECT_EQ(estimate_at(maps.delta_ct, point).value, estimate_at(maps.delta_ct, image).value);
    EXPECT_EQ(estimate_at(maps.uneven_thrust, point).value, -estimate_at(maps.uneven_thrust, image).value);
    for (const FittedField* field : {&maps.delta_ct, &maps.uneven_thrust}) {
      EXPECT_EQ(estimate_at(*field, point).standard_uncertainty,
                estimate_at(*field, image).standard_uncertainty);
    }
  }
}

TEST_P(Field, IsExactlyZeroWhereItIsKnownToBe) {
  const TunnelMaps maps = fit(published_input(2, {.shared_gain_percent = 2, .shared_u_percent = 0.5}));
  EXPECT_EQ(estimate_at(maps.delta_ct, {0, 0}).value, 0);
  EXPECT_EQ(estimate_at(maps.delta_ct, {0, 0}).standard_uncertainty, 0);
  for (const double z_norm : {-1.0, -0.64, -0.1, 0.0, 0.333, 1.0}) {
    EXPECT_EQ(estimate_at(maps.uneven_thrust, {0, z_norm}).value, 0) << z_norm;
    EXPECT_EQ(estimate_at(maps.uneven_thrust, {0, z_norm}).standard_uncertainty, 0) << z_norm;
  }
}

TEST_P(Field, IsExpandedByTheDegreesOfFreedomOfWhatItLeansOn) {
  MapInput input = published_input(3, {.independent_percent = 0.1, .shared_u_percent = 0.2});
  const TunnelMaps known = fit(input);
  const auto n = static_cast<Index>(input.locations.size());
  const double root = std::sqrt(2.0);  // of 2 degrees of freedom
  input.u_over_root_dof = {MatrixXd::Constant(n, n, 0.04 / root), MatrixXd::Identity(n, n) * 0.01 / root};
  const TunnelMaps maps = fit(input);
  const TunnelPoint place{input.locations[20].y_norm, input.locations[20].z_norm};
  const FieldEstimate before = estimate_at(known.uneven_thrust, place),
                      there = estimate_at(maps.uneven_thrust, place);
  EXPECT_EQ(there.value, before.value);
  EXPECT_EQ(there.standard_uncertainty, before.standard_uncertainty);
  EXPECT_NEAR(before.u95(), 1.96 * before.standard_uncertainty, 1e-4);
  EXPECT_GT(there.u95(), 1.01 * before.u95());
  EXPECT_NEAR(there.u95(), student_t_quantile(0.975, there.dof) * there.standard_uncertainty, 1e-12);
  if (GetParam() == MapMethod::kThinPlateSpline) {
    // Its weights at a measured place are 1 and 0, and −1/7 on ȳ = 0: what all share is gone with the offset.
    EXPECT_NEAR(there.standard_uncertainty, std::sqrt(0.01 + 0.01 / 7), 1e-6);
    EXPECT_NEAR(there.dof, 2, 1e-6);
    EXPECT_NEAR(offset_of(maps.uneven_thrust)->dof,
                std::pow(0.04 + 0.01 / 7, 2) / (0.04 * 0.04 / 2 + std::pow(0.01 / 7, 2) / 2), 1e-6);
  }
  const MapGrid grid = regular_grid(5);
  EXPECT_EQ(sample(maps.delta_ct, grid).u95_percent, sample(known.delta_ct, grid).u95_percent);
}

TEST_P(Field, RefusesToExtrapolate) {
  const TunnelMaps maps = fit(published_input(1));
  for (const TunnelPoint& point : {TunnelPoint{1.0001, 0}, TunnelPoint{0, -1.5},
                                   TunnelPoint{std::numeric_limits<double>::quiet_NaN(), 0}}) {
    EXPECT_THAT(message_of([&] { estimate_at(maps.delta_ct, point); }), HasSubstr("refuses to extrapolate"));
    EXPECT_THAT(message_of([&] { estimate_at(maps.uneven_thrust, point); }),
                HasSubstr("refuses to extrapolate"));
  }
}

TEST_P(Field, FollowsExactMeasurements) {
  const TunnelMaps maps = fit(test::exact_input({.independent_percent = 0}));
  for (const LocationEstimate& location : maps.input.locations) {
    const TunnelPoint point{location.y_norm, location.z_norm};
    EXPECT_NEAR(estimate_at(maps.delta_ct, point).value, test::true_delta_ct_percent(point), 0.02)
        << location.label;
    EXPECT_NEAR(estimate_at(maps.uneven_thrust, point).value, test::true_uneven_thrust_percent(point), 0.02)
        << location.label;
  }
}

TEST_P(Field, RecoversThePublishedField) {
  const TunnelMaps maps = fit(published_input(3));
  double delta_ct = 0, uneven = 0;
  const MapGrid grid = regular_grid(41);
  for (const double z_norm : grid.z_norm) {
    for (const double y_norm : grid.y_norm) {
      const TunnelPoint point{y_norm, z_norm};
      delta_ct += std::pow(estimate_at(maps.delta_ct, point).value - test::true_delta_ct_percent(point), 2);
      uneven +=
          std::pow(estimate_at(maps.uneven_thrust, point).value - test::true_uneven_thrust_percent(point), 2);
    }
  }
  // U has a ridge at z̄ = −0.5, narrower than the rows of locations beside it, that no interpolation can see.
  EXPECT_LT(std::sqrt(delta_ct / static_cast<double>(grid.nodes())), 0.25);
  EXPECT_LT(std::sqrt(uneven / static_cast<double>(grid.nodes())), 0.35);
}

TEST_P(Field, AGainSharedByAllLocationsChangesNothing) {
  const TunnelMaps alone = fit(test::exact_input()),
                   shared = fit(test::exact_input({.shared_gain_percent = 3}));
  for (const TunnelPoint& point : kPoints) {
    const FieldEstimate a = estimate_at(alone.delta_ct, point), b = estimate_at(shared.delta_ct, point);
    EXPECT_NEAR(a.value, b.value, 1e-6);
    EXPECT_NEAR(a.standard_uncertainty, b.standard_uncertainty, 1e-6);
  }
}

TEST_P(Field, CentreLineLocationsAreNotCountedAsPredictionsOfU) {
  const TunnelMaps maps = fit(published_input(1));
  EXPECT_EQ(leave_one_out(maps.delta_ct).size(), 41u);
  EXPECT_EQ(leave_one_out(maps.uneven_thrust).size(), 35u);
}

TEST_P(Field, FourLocationsAreEnough) {
  const TunnelMaps maps = fit(test::only(published_input(1), {"OT", "H0V2", "H4V-2", "H4V2"}));
  for (const TunnelPoint& point : kPoints) {
    EXPECT_LT(std::abs(estimate_at(maps.delta_ct, point).value), 20);
    EXPECT_LT(std::abs(estimate_at(maps.uneven_thrust, point).value), 20);
    EXPECT_TRUE(std::isfinite(estimate_at(maps.uneven_thrust, point).standard_uncertainty));
  }
  for (const LeftOut& location : leave_one_out(maps.delta_ct)) EXPECT_TRUE(std::isfinite(location.predicted));
}

TEST_P(Field, MeasuredOnTheLeftIsTheSameMap) {
  MapInput left = published_input(4);
  for (LocationEstimate& location : left.locations) {
    location.y_norm = -location.y_norm;
    location.u_percent = -location.u_percent;
  }
  const TunnelMaps a = fit(published_input(4)), b = fit(left);
  for (const TunnelPoint& point : kPoints) {
    EXPECT_NEAR(estimate_at(a.delta_ct, point).value, estimate_at(b.delta_ct, point).value, 1e-9);
    EXPECT_NEAR(estimate_at(a.uneven_thrust, point).value, estimate_at(b.uneven_thrust, point).value, 1e-9);
  }
}

TEST(ThinPlateSpline, PassesThroughEveryMeasuredValue) {
  const MapInput merged = merge_locations(published_input(1));
  for (const FieldData& data : {thrust_change_data(merged), uneven_thrust_data(merged)}) {
    const ThinPlateSpline spline(data);
    for (Index i = 0; i < data.size(); ++i) {
      const TunnelPoint& point = data.points[static_cast<std::size_t>(i)];
      if (data.parity == Parity::kOdd && point.y_norm == 0) continue;
      const FieldEstimate offset = spline.offset().value_or(FieldEstimate{});
      EXPECT_NEAR(spline.at(point).value, data.values(i) - offset.value, 1e-9);
      EXPECT_NEAR(spline.at(point).standard_uncertainty,
                  std::hypot(std::sqrt(data.covariance(i, i)), offset.standard_uncertainty), 1e-9);
    }
  }
}

TEST(ThinPlateSpline, LeaveOneOutIsWhatRefittingGives) {
  const MapInput merged =
      merge_locations(published_input(1, {.shared_gain_percent = 1, .shared_u_percent = 0.3}));
  for (const FieldData& data : {thrust_change_data(merged), uneven_thrust_data(merged)}) {
    for (const LeftOut& left : ThinPlateSpline(data).leave_one_out()) {
      const Index i = std::find(data.labels.begin(), data.labels.end(), left.label) - data.labels.begin();
      const ThinPlateSpline rest(without(data, i));
      const double offset = rest.offset() ? rest.offset()->value : 0;
      EXPECT_NEAR(left.predicted, rest.at(data.points[static_cast<std::size_t>(i)]).value + offset, 1e-8)
          << left.label;
    }
  }
}

TEST(ThinPlateSpline, ALocationThatAloneHoldsTheSlopeIsNotLeftOut) {
  MapInput input = test::only(published_input(1), {"OT", "H1V0", "H3V0", "H2V2"});
  EXPECT_EQ(ThinPlateSpline(thrust_change_data(merge_locations(input))).leave_one_out().size(), 2u);
}

TEST(GaussianProcess, LeaveOneOutIsWhatRefittingGives) {
  const MapInput merged =
      merge_locations(published_input(1, {.shared_gain_percent = 1, .shared_u_percent = 0.3}));
  for (const FieldData& data : {thrust_change_data(merged), uneven_thrust_data(merged)}) {
    const Hyperparameters h{.amplitude_percent = 3, .length_y = 1.2, .length_z = 0.8, .excess_percent = 0.1};
    const auto base = [&h](double dy, double dz) { return matern(h, dy, dz)(0); };
    MatrixXd covariance = noise_covariance(data, h);
    for (Index i = 0; i < data.size(); ++i) {
      for (Index j = 0; j < data.size(); ++j) {
        covariance(i, j) += anchored(base, data.parity, data.points[static_cast<std::size_t>(i)],
                                     data.points[static_cast<std::size_t>(j)]);
      }
    }
    for (const LeftOut& left : GaussianProcess(data, h).leave_one_out()) {
      const Index i = std::find(data.labels.begin(), data.labels.end(), left.label) - data.labels.begin();
      std::vector<Index> rest;
      for (Index j = 0; j < data.size(); ++j) {
        if (j != i) rest.push_back(j);
      }
      const UniversalKriging kriging{covariance(rest, rest), data.values(rest), data.offset_column(rest)};
      const FieldEstimate expected =
          kriging.predict(covariance(rest, i), covariance(i, i), data.offset_column(i));
      EXPECT_NEAR(left.predicted, expected.value, 1e-8) << left.label;
      EXPECT_NEAR(left.standard_uncertainty, expected.standard_uncertainty, 1e-8);
    }
  }
}

TEST(GaussianProcess, LeavingOutIsRefittingTheMapWhereErrorsAreIndependent) {
  const FieldData data = uneven_thrust_data(merge_locations(published_input(1)));
  const Hyperparameters h{.amplitude_percent = 3, .length_y = 1.2, .length_z = 0.8};
  for (const LeftOut& left : GaussianProcess(data, h).leave_one_out()) {
    const Index i = std::find(data.labels.begin(), data.labels.end(), left.label) - data.labels.begin();
    const GaussianProcess rest(without(data, i), h);
    EXPECT_NEAR(left.predicted,
                rest.at(data.points[static_cast<std::size_t>(i)]).value + rest.offset()->value, 1e-7)
        << left.label;
  }
}

TEST(GaussianProcess, AnOffsetOfUThatAllLocationsShareIsRecognisedByItsSymmetry) {
  const TunnelMaps maps = fit_maps(published_input(7, {.independent_percent = 0.02, .shared_u_percent = 3}));
  const auto& process = std::get<GaussianProcess>(maps.uneven_thrust);
  for (const char* label : {"H5V3", "H3V1", "H4V0"}) {
    const TunnelPoint point = *grid_point(label);
    EXPECT_NEAR(process.at(point).value, test::true_uneven_thrust_percent(point), 0.15) << label;
    EXPECT_LT(process.at(point).standard_uncertainty, 0.2) << label;
  }
}

TEST(GaussianProcess, DerivativesOfTheKernelAreThoseOfItsValue) {
  const auto value = [](double length_y, double length_z) {
    return matern({.amplitude_percent = 2, .length_y = length_y, .length_z = length_z}, 0.4, -0.7)(0);
  };
  const Eigen::Array3d terms = matern({.amplitude_percent = 2, .length_y = 0.5, .length_z = 0.9}, 0.4, -0.7);
  constexpr double kStep = 1e-6;
  EXPECT_NEAR(terms(1), (value(0.5 * (1 + kStep), 0.9) - value(0.5 * (1 - kStep), 0.9)) / (2 * kStep), 1e-8);
  EXPECT_NEAR(terms(2), (value(0.5, 0.9 * (1 + kStep)) - value(0.5, 0.9 * (1 - kStep))) / (2 * kStep), 1e-8);
}

TEST(GaussianProcess, ScatterThatNobodyDeclaredBecomesExcess) {
  MapInput undeclared = published_input(11, {.independent_percent = 0.4});
  undeclared.c_t_covariance *= 1e-4;
  undeclared.u_covariance *= 1e-4;
  const TunnelMaps maps = fit_maps(undeclared);
  EXPECT_NEAR(std::get<GaussianProcess>(maps.delta_ct).hyperparameters().excess_percent, 0.4, 0.2);
  EXPECT_NEAR(std::get<GaussianProcess>(maps.uneven_thrust).hyperparameters().excess_percent, 0.4, 0.2);
}

TEST(MapMethod, HasItsName) {
  for (const MapMethod method : test::kMethods) EXPECT_EQ(map_method(name_of(method)), method);
  EXPECT_THAT(message_of([] { map_method("kriging"); }),
              HasSubstr("there are gaussian-process and thin-plate-spline"));
}

}  // namespace
}  // namespace tunnelrig
