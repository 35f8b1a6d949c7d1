#include "analysis/variance_components.h"

#include "support/seeds.h"

#include <cmath>
#include <random>

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
