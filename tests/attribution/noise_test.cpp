// What generated campaigns scatter by.
#include "attribution/generator/campaign.h"
#include "support/seeds.h"

#include <cmath>
#include <map>
#include <utility>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

namespace tunnelrig::attribution {
namespace {

/// Scatter of many campaigns, as estimated from what was drawn.
struct Moments {
  double run = 0, session = 0, lag = 0, kurtosis = 0, common = 0;
};

Moments moments_of(Noise kind, NoiseModel& model) {
  Moments sum;
  double squares = 0, fourths = 0, lags = 0, products = 0, rows = 0;
  double between = 0, within = 0, sessions = 0;
  for (std::uint64_t seed = test::seed(); seed < test::seed() + 60; ++seed) {
    const Campaign campaign = generate({.noise = kind, .runs = 430, .seed = seed});
    model = campaign.noise;
    const World& world = campaign.world;
    std::map<int, std::vector<std::size_t>> by_session;
    for (std::size_t i = 0; i < world.runs.size(); ++i) by_session[world.runs[i].session].push_back(i);
    for (const auto& [id, indices] : by_session) {
      const auto n = static_cast<double>(indices.size());
      Rotors mean{};
      for (const std::size_t i : indices) {
        for (std::size_t r = 0; r < kRotors; ++r) mean[r] += campaign.scatter[i][r] / n;
      }
      ++sessions;
      between += mean[0] * mean[0] / (model.session * model.session + model.run * model.run / n);
      double inside = 0;
      for (std::size_t k = 0; k < indices.size(); ++k) {
        const Rotors& now = campaign.scatter[indices[k]];
        const double a = now[0] - mean[0], b = now[1] - mean[1];
        inside += a * a;
        squares += a * a;
        fourths += a * a * a * a;
        products += a * b;
        ++rows;
        if (k > 0) lags += a * (campaign.scatter[indices[k - 1]][0] - mean[0]);
      }
      within += inside / (n - 1);
    }
  }
  sum.run = std::sqrt(within / sessions) / model.run;
  sum.session = std::sqrt(between / sessions);  // over what it should be
  sum.lag = lags / squares;
  sum.kurtosis = fourths / rows / (squares / rows * squares / rows);
  sum.common = products / squares;
  return sum;
}

TEST(Noise, WhiteAndSessionOffsets) {
  for (const Noise kind : {Noise::kWhite, Noise::kSession}) {
    NoiseModel model;
    const Moments found = moments_of(kind, model);
    EXPECT_NEAR(found.run, 1, 0.02);
    EXPECT_NEAR(found.session, 1, 0.05);
    EXPECT_NEAR(found.lag, 0, 0.06);
    EXPECT_NEAR(found.kurtosis, 3, 0.15);
    EXPECT_NEAR(found.common, model.run_common, 0.03);
    EXPECT_EQ(model.session > 0, kind == Noise::kSession);
  }
}

TEST(Noise, AutocorrelatedRemembers) {
  NoiseModel model;
  const Moments found = moments_of(Noise::kAutocorrelated, model);
  EXPECT_GT(found.lag, 0.2);
  EXPECT_LT(found.lag, 0.6);
}

TEST(Noise, HeavyTailsAreHeavyAndOfTheSameVariance) {
  NoiseModel model;
  const Moments found = moments_of(Noise::kHeavyTailed, model);
  EXPECT_GT(found.kurtosis, 4);
  EXPECT_NEAR(found.run, 1, 0.05);
}

TEST(Noise, NothingElseIsInACampaignWithoutEffect) {
  const Campaign campaign = generate({.noise = Noise::kSession, .seed = test::seed()});
  for (std::size_t i = 0; i < campaign.world.runs.size(); ++i) {
    for (std::size_t r = 0; r < kRotors; ++r) {
      EXPECT_DOUBLE_EQ(campaign.measured_N[i][r],
                       campaign.world.baseline_N[i][r] * (1 + campaign.scatter[i][r]));
    }
  }
}

/// Of the first rotor's scatter, over the runs of sealed sessions: squared errors of the locations'
/// generalised least squares from the other sessions, and how many.
std::pair<double, int> held_out_squares(const Campaign& campaign, const NoiseModel& noise, int sealed) {
  std::vector<std::size_t> open;
  std::map<std::string, Eigen::Index> places;
  const auto& runs = campaign.world.runs;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    if (runs[i].session % 4 == sealed) continue;
    open.push_back(i);
    places.emplace(runs[i].location, static_cast<Eigen::Index>(places.size()));
  }
  const auto n = static_cast<Eigen::Index>(open.size());
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(n, n);
  Eigen::MatrixXd of_place = Eigen::MatrixXd::Zero(n, static_cast<Eigen::Index>(places.size()));
  Eigen::VectorXd scatter(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const std::size_t run = open[static_cast<std::size_t>(i)];
    scatter(i) = campaign.scatter[run][0];
    of_place(i, places.at(runs[run].location)) = 1;
    for (Eigen::Index j = 0; j < n; ++j)
      if (runs[run].session == runs[open[static_cast<std::size_t>(j)]].session)
        covariance(i, j) = std::pow(noise.session, 2) +
                           std::pow(noise.run, 2) * std::pow(noise.persistence, std::abs(i - j));
  }
  const Eigen::MatrixXd weighted = covariance.ldlt().solve(of_place);
  const Eigen::VectorXd mean = (of_place.transpose() * weighted).ldlt().solve(weighted.transpose() * scatter);
  std::pair<double, int> result{0, 0};
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const auto place = places.find(runs[i].location);
    if (runs[i].session % 4 != sealed || place == places.end()) continue;
    result.first += std::pow(campaign.scatter[i][0] - mean(place->second), 2);
    ++result.second;
  }
  return result;
}

double mean_square_thrust(const World& world) {
  double sum = 0;
  for (const Rotors& run : world.baseline_N)
    for (const double thrust_N : run) sum += thrust_N * thrust_N;
  return sum / static_cast<double>(kRotors * world.baseline_N.size());
}

TEST(Noise, FloorIsTheHeldOutErrorOfAnExactModel) {
  constexpr int kCampaigns = 100;
  for (const Noise noise : {Noise::kWhite, Noise::kSession, Noise::kAutocorrelated}) {
    double left = 0, said = 0;
    for (std::uint64_t seed = test::seed(); seed < test::seed() + kCampaigns; ++seed) {
      const Settings settings{.noise = noise, .seed = seed};
      const Campaign campaign = generate(settings);
      double squares = 0;
      int count = 0;
      for (int sealed = 0; sealed < 4; ++sealed) {
        const auto [sum, n] = held_out_squares(campaign, draw_noise_model(settings), sealed);
        squares += sum;
        count += n;
      }
      left += squares / count * mean_square_thrust(campaign.world);
      said += std::pow(campaign.floor.with_coefficients_N, 2);
    }
    EXPECT_NEAR(std::sqrt(left / said), 1, 0.025) << "noise " << static_cast<int>(noise);
  }
}

}  // namespace
}  // namespace tunnelrig::attribution
