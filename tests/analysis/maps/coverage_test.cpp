#include "analysis/maps/measured_region.h"
#include "analysis/maps/tunnel_maps.h"
#include "published_input.h"
#include "support/seeds.h"

#include <array>
#include <cmath>
#include <cstdio>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

constexpr int kCampaigns = 50, kPoints = 100;

/// Share of the points, off the locations' grid and over campaigns, where the interval holds the true value.
struct Coverage {
  double delta_ct = 0, uneven_thrust = 0;
  double both() const { return (delta_ct + uneven_thrust) / 2; }
};

Coverage coverage(std::uint64_t seed, const test::MeasurementErrors& errors) {
  std::mt19937_64 engine(seed);
  std::uniform_real_distribution<double> anywhere(-1, 1);
  std::array<int, 2> covered = {0, 0};
  for (std::uint64_t campaign = 0; campaign < kCampaigns; ++campaign) {
    const TunnelMaps maps = fit_maps(test::published_input(seed + campaign, errors));
    for (int i = 0; i < kPoints; ++i) {
      const TunnelPoint point{anywhere(engine), anywhere(engine)};
      const FieldEstimate delta_ct = estimate_at(maps.delta_ct, point);
      const FieldEstimate uneven = estimate_at(maps.uneven_thrust, point);
      covered[0] += std::abs(delta_ct.value - test::true_delta_ct_percent(point)) <
                    1.96 * delta_ct.standard_uncertainty;
      covered[1] += std::abs(uneven.value - test::true_uneven_thrust_percent(point)) <
                    1.96 * uneven.standard_uncertainty;
    }
  }
  return {static_cast<double>(covered[0]) / (kCampaigns * kPoints),
          static_cast<double>(covered[1]) / (kCampaigns * kPoints)};
}

TEST(Coverage, OfTheGaussianProcessIsNearNominal) {
  const std::uint64_t seed = test::seed();
  for (const double error_percent : {0.05, 0.1, 0.2}) {
    for (const double shared_percent : {0.0, 0.5}) {
      const Coverage measured = coverage(seed, {.independent_percent = error_percent,
                                                .shared_gain_percent = 2 * shared_percent,
                                                .shared_u_percent = shared_percent});
      std::printf("seed %llu, errors %.2f %%, shared %.1f %%: coverage of dC_T %.3f, of U %.3f\n",
                  static_cast<unsigned long long>(seed), error_percent, shared_percent, measured.delta_ct,
                  measured.uneven_thrust);
      EXPECT_GT(measured.both(), 0.90);
      EXPECT_LT(measured.both(), 0.98);
      // The field's ΔC_T is smoother than the kernel, its U rougher than the locations can show
      // (docs/maps.md).
      EXPECT_GT(measured.delta_ct, 0.93);
      EXPECT_GT(measured.uneven_thrust, 0.85);
    }
  }
}

/// Shares of points inside the locations' hull and beyond it where a 95 % interval holds the true value.
struct Extrapolated {
  std::array<Coverage, 2> of;
  double beyond = 0;  // share of the square
};

Extrapolated extrapolated(std::uint64_t seed, const std::vector<std::string>& labels, MapMethod method) {
  constexpr int kFew = 14, kPointsOfEach = 400;
  std::mt19937_64 engine(seed);
  std::uniform_real_distribution<double> anywhere(-1, 1);
  Extrapolated result;
  std::array<double, 2> points = {0, 0};
  for (std::uint64_t campaign = 0; campaign < kFew; ++campaign) {
    const MapInput input = test::only(test::published_input(seed + campaign), labels);
    const TunnelMaps maps = fit_maps(input, {.method = method});
    const MeasuredRegion region = measured_region({.locations = measured_locations(maps.input)});
    result.beyond = region.share_outside();
    for (int i = 0; i < kPointsOfEach; ++i) {
      const TunnelPoint point{anywhere(engine), anywhere(engine)};
      const std::size_t where = region.holds(point) ? 0 : 1;
      const FieldEstimate delta_ct = estimate_at(maps.delta_ct, point),
                          uneven = estimate_at(maps.uneven_thrust, point);
      points[where] += 1;
      result.of[where].delta_ct +=
          std::abs(delta_ct.value - test::true_delta_ct_percent(point)) < delta_ct.u95() ? 1 : 0;
      result.of[where].uneven_thrust +=
          std::abs(uneven.value - test::true_uneven_thrust_percent(point)) < uneven.u95() ? 1 : 0;
    }
  }
  for (std::size_t where = 0; where < 2; ++where) {
    result.of[where].delta_ct /= points[where];
    result.of[where].uneven_thrust /= points[where];
  }
  return result;
}

/// Why pictures hatch what lies beyond the locations: U95 does not hold there what it says.
TEST(Coverage, IsLessWhereTheMapExtrapolates) {
  const std::uint64_t seed = test::seed();
  std::vector<std::string> nine, to_h3;
  for (const char* column : {"H0", "H2", "H4"})
    for (const char* row : {"V2", "V0", "V-2"}) nine.push_back(canonical_location(std::string(column) + row));
  for (const std::string& label : tunnel_grid())
    if (grid_point(label)->y_norm < 0.7) to_h3.push_back(label);
  for (const auto& [name, labels] : {std::pair{"9 locations", nine}, {"28 locations (H0 to H3)", to_h3}}) {
    for (const MapMethod method : test::kMethods) {
      const Extrapolated shares = extrapolated(seed, labels, method);
      std::printf("%s, %s, %.0f %% beyond: inside %.2f / %.2f, beyond %.2f / %.2f\n", name,
                  name_of(method).c_str(), 100 * shares.beyond, shares.of[0].delta_ct,
                  shares.of[0].uneven_thrust, shares.of[1].delta_ct, shares.of[1].uneven_thrust);
      EXPECT_LT(shares.of[1].both(), shares.of[0].both() - 0.03);
    }
  }
}

/// Share of campaigns whose interval holds the offset that their rig has.
double coverage_of_offset(std::uint64_t seed, MapMethod method, const test::MeasurementErrors& errors) {
  constexpr int kRigs = 200;
  constexpr double kOffset_percent = 1;
  int covered = 0;
  for (std::uint64_t rig = 0; rig < kRigs; ++rig) {
    MapInput input = test::published_input(seed + rig, errors);
    for (LocationEstimate& location : input.locations) location.u_percent += kOffset_percent;
    const FieldEstimate offset = *offset_of(fit_maps(input, {.method = method}).uneven_thrust);
    covered += std::abs(offset.value - kOffset_percent) < offset.u95();
  }
  return static_cast<double>(covered) / kRigs;
}

TEST(Coverage, OfTheRigsOffsetIsNominal) {
  const std::uint64_t seed = test::seed();
  for (const double shared_percent : {0.0, 0.5}) {
    for (const MapMethod method : test::kMethods) {
      const double measured = coverage_of_offset(seed, method, {.shared_u_percent = shared_percent});
      std::printf("seed %llu, shared %.1f %%, %s: coverage of the rig's offset %.3f\n",
                  static_cast<unsigned long long>(seed), shared_percent, name_of(method).c_str(), measured);
      EXPECT_NEAR(measured, 0.95, 0.06);  // four standard deviations of 200 campaigns
    }
  }
}

/// Means over campaigns of one field's errors in percentage points.
struct FieldErrors {
  double leave_one_out = 0, standardised = 0, off_grid = 0;

  void add(const FittedField& field, double (*truth)(const TunnelPoint&), std::mt19937_64& engine) {
    const LeaveOneOutSummary summary = summarize(tunnelrig::leave_one_out(field));
    leave_one_out += summary.rms_percent / kCampaigns;
    standardised += summary.standardised_rms.value_or(0) / kCampaigns;
    std::uniform_real_distribution<double> anywhere(-1, 1);
    double squares = 0;
    for (int i = 0; i < kPoints; ++i) {
      const TunnelPoint point{anywhere(engine), anywhere(engine)};
      squares += std::pow(estimate_at(field, point).value - truth(point), 2);
    }
    off_grid += std::sqrt(squares / kPoints) / kCampaigns;
  }
};

TEST(LeaveOneOut, TellsTheErrorThatTheMapHas) {
  const std::uint64_t seed = test::seed();
  std::mt19937_64 engine(seed);
  for (const double error_percent : {0.05, 0.1, 0.2}) {
    for (const MapMethod method : test::kMethods) {
      FieldErrors delta_ct, uneven;
      for (std::uint64_t campaign = 0; campaign < kCampaigns; ++campaign) {
        const MapInput input = test::published_input(seed + campaign, {.independent_percent = error_percent});
        const TunnelMaps maps = fit_maps(input, {.method = method});
        delta_ct.add(maps.delta_ct, test::true_delta_ct_percent, engine);
        uneven.add(maps.uneven_thrust, test::true_uneven_thrust_percent, engine);
      }
      std::printf(
          "seed %llu, errors %.2f %%, %s: leave-one-out %.3f / %.3f, standardised %.2f / %.2f, off grid %.3f "
          "/ %.3f\n",
          static_cast<unsigned long long>(seed), error_percent, name_of(method).c_str(),
          delta_ct.leave_one_out, uneven.leave_one_out, delta_ct.standardised, uneven.standardised,
          delta_ct.off_grid, uneven.off_grid);
      // A left-out location is farther from its neighbours than any point of the map is.
      EXPECT_LT(delta_ct.off_grid, 1.1 * delta_ct.leave_one_out);
      EXPECT_LT(uneven.off_grid, 1.3 * uneven.leave_one_out);
      if (method == MapMethod::kGaussianProcess) {
        EXPECT_NEAR(delta_ct.standardised, 1, 0.35);
        EXPECT_NEAR(uneven.standardised, 1, 0.35);
      }
    }
  }
}

}  // namespace
}  // namespace tunnelrig
