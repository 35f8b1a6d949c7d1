#include "analysis/variance_components.h"

#include "analysis/restricted_likelihood.h"
#include "calibration/distributions.h"
#include "support/seeds.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <random>
#include <utility>

#include <Eigen/LU>
#include <fmt/format.h>
#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

struct Design {
  std::size_t locations = 30, sessions = 10, per_visit = 3, visits = 3;
};

GroupedRuns simulate(const Design& design, double run, double visit, double session,
                     std::mt19937_64& engine) {
  std::normal_distribution<double> unit;
  GroupedRuns runs;
  std::vector<double> offset(design.sessions);
  for (double& value : offset) value = session * unit(engine);
  for (std::size_t l = 0; l < design.locations; ++l) {
    for (std::size_t v = 0; v < design.visits; ++v) {
      const std::size_t s = (l * 7 + v * 3) % design.sessions;
      const double here = visit * unit(engine);
      for (std::size_t r = 0; r < design.per_visit; ++r) {
        runs.location.push_back(l);
        runs.session.push_back(s);
        runs.value.push_back(static_cast<double>(l) + offset[s] + here + run * unit(engine));
      }
    }
  }
  return runs;
}

TEST(VarianceComponents, AreUnbiasedOverManyCampaigns) {
  const std::uint64_t seed = test::seed();
  SCOPED_TRACE(seed);
  std::mt19937_64 engine(seed);
  double run = 0, visit = 0, session = 0;
  const int campaigns = 60;
  for (int i = 0; i < campaigns; ++i) {
    const VarianceComponents found = fit_variance_components(simulate({}, 0.3, 0.2, 0.5, engine));
    EXPECT_TRUE(found.run_known && found.visit_known && found.session_known);
    run += found.run / campaigns;
    visit += found.visit / campaigns;
    session += found.session / campaigns;
  }
  EXPECT_NEAR(run, 0.09, 0.005);
  EXPECT_NEAR(visit, 0.04, 0.006);
  EXPECT_NEAR(session, 0.25, 0.05);
}

TEST(VarianceComponents, NoneIsZeroAndTheDesignSaysWhatCannotBeSeen) {
  std::mt19937_64 engine(3);
  EXPECT_LT(fit_variance_components(simulate({}, 0.3, 0, 0, engine)).session, 0.01);
  const VarianceComponents one_session =
      fit_variance_components(simulate({.sessions = 1, .visits = 1}, 0.3, 0, 0, engine));
  EXPECT_TRUE(one_session.run_known);
  EXPECT_FALSE(one_session.session_known);
  const VarianceComponents single_runs =
      fit_variance_components(simulate({.per_visit = 1, .visits = 4}, 0.3, 0, 0.2, engine));
  EXPECT_FALSE(single_runs.run_known) << "with one run per visit, visit and run are one";
  EXPECT_NEAR(single_runs.visit, 0.09, 0.03);
  const VarianceComponents nothing =
      fit_variance_components({.location = {0, 1}, .session = {0, 1}, .value = {1, 2}});
  EXPECT_FALSE(nothing.run_known || nothing.visit_known || nothing.session_known);
}

TEST(VarianceComponents, LocationsThatScatterDifferentlyKeepTheirOwn) {
  std::mt19937_64 engine(5);
  std::normal_distribution<double> unit;
  GroupedRuns runs;
  for (std::size_t l = 0; l < 40; ++l) {
    for (int r = 0; r < 10; ++r) {
      runs.location.push_back(l);
      runs.session.push_back(0);
      runs.value.push_back((l % 2 == 0 ? 0.1 : 1.0) * unit(engine));
    }
  }
  const VarianceComponents found = fit_variance_components(runs);
  for (std::size_t l = 0; l < 40; ++l)
    EXPECT_TRUE((found.run_by_location[l] < 0.2) == (l % 2 == 0)) << l << " " << found.run_by_location[l];
  const VarianceComponents alike = fit_variance_components(simulate({}, 0.3, 0, 0, engine));
  for (const double variance : alike.run_by_location)
    EXPECT_EQ(variance, alike.run) << "what chance explains is pooled";
}

struct NoisyLocation {
  std::size_t locations = 6;
  double factor = 1;                               // by which location 0 scatters more
  double at_least = 0.93, others_at_least = 0.93;  // coverage there, and elsewhere
  double pooled_at_least = 0, pooled_at_most = 1;  // the share of campaigns whose scatter is pooled
};

/// Two sessions of five runs, at one location more scatter: whether the means' 95 % intervals hold the truth.
class NoisyLocations : public testing::TestWithParam<NoisyLocation> {};

TEST_P(NoisyLocations, HaveErrorBarsOfTheirOwn) {
  const NoisyLocation& noisy = GetParam();
  const std::uint64_t seed = test::seed();
  SCOPED_TRACE(seed);
  std::mt19937_64 engine(seed);
  std::normal_distribution<double> unit;
  constexpr int kCampaigns = 400;
  const double run = 0.3, more = run * std::sqrt(noisy.factor * noisy.factor - 1);
  double covered = 0, others = 0, pooled = 0;  // shares
  for (int i = 0; i < kCampaigns; ++i) {
    GroupedRuns runs = simulate({.locations = noisy.locations, .sessions = 2, .per_visit = 5, .visits = 2},
                                run, 0, 0, engine);
    for (std::size_t r = 0; r < 10; ++r) runs.value[r] += more * unit(engine);
    const VarianceComponents found = fit_variance_components(runs);
    const LocationMeans means = location_means(runs, found);
    for (std::size_t l = 0; l < noisy.locations; ++l) {
      const auto row = static_cast<Eigen::Index>(l);
      const double u95 = half_width_95(std::sqrt(means.covariance(row, row)), means.dof[l]);
      if (std::abs(means.mean[l] - static_cast<double>(l)) > u95) continue;
      (l == 0 ? covered : others) += 1.0 / kCampaigns;
    }
    pooled += found.run_by_location[0] == found.run ? 1.0 / kCampaigns : 0;
  }
  others /= static_cast<double>(noisy.locations - 1);
  std::printf("%zu locations, one with %g times the scatter: %.3f covered, others %.3f; pooled in %.2f\n",
              noisy.locations, noisy.factor, covered, others, pooled);
  EXPECT_GT(covered, noisy.at_least);
  EXPECT_GT(others, noisy.others_at_least);
  EXPECT_GE(pooled, noisy.pooled_at_least);
  EXPECT_LE(pooled, noisy.pooled_at_most);
}

INSTANTIATE_TEST_SUITE_P(
    Campaigns, NoisyLocations,
    testing::Values(NoisyLocation{.factor = 1, .at_least = 0.92, .pooled_at_least = 0.9},
                    NoisyLocation{.locations = 42, .factor = 1, .at_least = 0.92, .pooled_at_least = 0.9},
                    NoisyLocation{.factor = 3, .at_least = 0.9, .pooled_at_most = 0.2},
                    NoisyLocation{.factor = 6, .at_least = 0.91, .pooled_at_most = 0.02},
                    NoisyLocation{.locations = 3, .factor = 6, .at_least = 0.91, .pooled_at_most = 0.02},
                    NoisyLocation{.locations = 20, .factor = 6, .at_least = 0.91, .pooled_at_most = 0.02}),
    [](const auto& noisy) {
      return fmt::format("{}LocationsOneWithScatterTimes{:g}", noisy.param.locations, noisy.param.factor);
    });

struct FewSessions {
  const char* name = "";
  std::size_t locations = 12, sessions = 6, per_visit = 10;
  std::size_t visits = 1;  // of every location but the first, which sees all sessions
  double session = 0.15;   // beside 0.25 of a run
  double at_least = 0.93;
  double u95_at_most = 0;  // median over the locations of one visit or few
};

class SessionsThatFewVisitsShow : public testing::TestWithParam<FewSessions> {};

/// Where only few degrees of freedom tell what sessions scatter, U95 holds the truth and says something.
TEST_P(SessionsThatFewVisitsShow, HaveIntervalsThatHoldAndAreNotTooWide) {
  const FewSessions& design = GetParam();
  const std::uint64_t seed = test::seed();
  SCOPED_TRACE(seed);
  std::mt19937_64 engine(seed);
  std::normal_distribution<double> unit;
  constexpr int kCampaigns = 200;
  double held = 0;
  std::vector<double> u95s;
  for (int i = 0; i < kCampaigns; ++i) {
    GroupedRuns runs;
    std::vector<double> offset(design.sessions);
    for (double& value : offset) value = design.session * unit(engine);
    for (std::size_t l = 0; l < design.locations; ++l) {
      const std::size_t visits = l == 0 ? design.sessions : design.visits;
      for (std::size_t r = 0; r < visits * (l == 0 ? 2 : design.per_visit); ++r) {
        runs.location.push_back(l);
        runs.session.push_back((l + r % visits) % design.sessions);
        runs.value.push_back(offset[runs.session.back()] + 0.25 * unit(engine));
      }
    }
    const LocationMeans means = location_means(runs, fit_variance_components(runs));
    for (std::size_t l = 0; l < design.locations; ++l) {
      const auto row = static_cast<Eigen::Index>(l);
      const double u95 = half_width_95(std::sqrt(means.covariance(row, row)), means.dof[l]);
      held += std::abs(means.mean[l]) <= u95 ? 1.0 / kCampaigns / static_cast<double>(design.locations) : 0;
      if (l > 0) u95s.push_back(u95);
    }
  }
  std::ranges::sort(u95s);
  std::printf("%s: held in %.3f, median U95 %.2f\n", design.name, held, u95s[u95s.size() / 2]);
  EXPECT_GT(held, design.at_least);
  EXPECT_LT(u95s[u95s.size() / 2], design.u95_at_most);
}

// A known scatter would give 0.33 and 0.36 in the first and last; by its estimate's variance alone U95 is 1.2
// in the first, three times as much, and the second's holds in 0.87.
INSTANTIATE_TEST_SUITE_P(
    Designs, SessionsThatFewVisitsShow,
    testing::Values(FewSessions{.name = "AnAnchorInSixSessions", .u95_at_most = 0.6},
                    FewSessions{.name = "TwoSessionsThatDiffer",
                                .sessions = 2,
                                .per_visit = 5,
                                .visits = 2,
                                .session = 0.6,
                                .at_least = 0.9,
                                .u95_at_most = 6},
                    FewSessions{
                        .name = "TwoVisitsOfSixSessions", .per_visit = 5, .visits = 2, .u95_at_most = 0.36}),
    [](const auto& design) { return std::string(design.param.name); });

/// With all matrices written out: X the locations, V the variance of the visits' means.
double likelihood_written_out(const VisitDesign& design, double visit, double session) {
  const auto n = static_cast<Eigen::Index>(design.visits.size());
  Eigen::MatrixXd x = Eigen::MatrixXd::Zero(n, static_cast<Eigen::Index>(design.locations)),
                  z = Eigen::MatrixXd::Zero(n, static_cast<Eigen::Index>(design.sessions));
  Eigen::VectorXd y(n);
  for (Eigen::Index v = 0; v < n; ++v) {
    const LocationVisit& here = design.visits[static_cast<std::size_t>(v)];
    x(v, static_cast<Eigen::Index>(here.location)) = z(v, static_cast<Eigen::Index>(here.session)) = 1;
    y(v) = here.mean;
  }
  const Eigen::MatrixXd variance = visit * Eigen::MatrixXd::Identity(n, n) + session * z * z.transpose();
  const Eigen::MatrixXd w = variance.inverse(), information = x.transpose() * w * x;
  const Eigen::VectorXd rest = y - x * (information.inverse() * (x.transpose() * (w * y)));
  return -0.5 * (std::log(variance.determinant()) + std::log(information.determinant()) + rest.dot(w * rest));
}

TEST(VarianceComponents, TheLikelihoodIsThatOfItsMatricesOfFewSessionsAndOfMany) {
  std::mt19937_64 engine(21);
  std::normal_distribution<double> unit;
  for (const std::size_t sessions : {std::size_t{4}, std::size_t{19}}) {
    VisitDesign design{.visits = {}, .locations = 7, .sessions = sessions};
    for (std::size_t s = 0; s < sessions; ++s)
      for (std::size_t l = 0; l < design.locations; ++l)
        if ((3 * s + l) % 4 != 0)
          design.visits.push_back({.location = l, .session = s, .runs = 1, .mean = 5 + unit(engine)});
    const VarianceComponents none;
    const RestrictedLikelihood likelihood(design, none);
    for (const auto& [visit, session] : {std::pair(0.3, 2.0), {1.5, 0.1}, {0.7, 0.0}})
      EXPECT_NEAR(likelihood(visit, session), likelihood_written_out(design, visit, session), 1e-8)
          << sessions << " sessions";
  }
}

TEST(LocationMeans, SharedSessionsCorrelateLocations) {
  GroupedRuns runs{
      .location = {0, 0, 1, 1, 2, 2}, .session = {0, 1, 0, 1, 2, 2}, .value = {1, 1.1, 2, 2.1, 3, 3.05}};
  VarianceComponents components;
  components.run_known = components.session_known = true;
  components.run_by_location = {0.01, 0.01, 0.01};
  components.run_dof = {5, 5, 5};
  components.session = 0.04;
  const LocationMeans means = location_means(runs, components);
  EXPECT_NEAR(means.mean[0], 1.05, 1e-12);
  EXPECT_NEAR(means.covariance(0, 0), 0.01 / 2 + 0.04 / 2, 1e-12);
  EXPECT_NEAR(means.covariance(0, 1), 0.04 / 2, 1e-12) << "both saw sessions 0 and 1 by halves";
  EXPECT_NEAR(means.covariance(0, 2), 0, 1e-15);
  EXPECT_NEAR(means.covariance(2, 2), 0.01 / 2 + 0.04, 1e-12)
      << "two runs of one session share its offset whole";
}

}  // namespace
}  // namespace tunnelrig
