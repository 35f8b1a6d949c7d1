// Does U95 cover the truth in 95 % of cases? Campaigns are made here, from scratch: volts from a known truth,
// by no code of the suite's.
#include "analysis/location_summary.h"
#include "support/seeds.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

struct Scenario {
  const char* name = "";
  int locations = 12, repeats = 6, sessions = 8;
  int visits = 0;  // sessions over which a location's runs are spread; 0: each run in any session
  double run = 0.0025, visit = 0, session = 0.0015;  // relative scatter of the thrust
  double rotor = 0.001;
  double gauge_N = 0.002, reading_V = 0.0002;  // so good that the scatter between runs is what matters
  int tares = 2;                               // of each session, evenly from its begin to its end
  double wander_V = 0;  // of a zero, from a session's begin to its end, as a random walk
  double drift_V = 0;   // likewise, in a straight line
  double tachometer_rpm = 0, thermometer_K = 0;  // systematic, declared in campaign.toml
  bool uneven_scatter = false;                   // locations scatter by factors of 0.4 to 2.5
};

constexpr double kSession_s = 30000;

/// What the four zeros of a session do in its course.
class Zeros {
 public:
  Zeros(const Scenario& s, const std::array<double, 4>& at_first, std::mt19937_64& engine) {
    std::normal_distribution<double> unit;
    std::array<double, 4> slope{};
    for (double& each : slope) each = s.drift_V == 0 ? 0 : s.drift_V * unit(engine) / kSteps;
    path_.push_back(at_first);
    for (int step = 0; step < kSteps; ++step) {
      path_.push_back(path_.back());
      for (std::size_t i = 0; i < 4; ++i)
        path_.back()[i] +=
            slope[i] + (s.wander_V == 0 ? 0 : s.wander_V * unit(engine) / std::sqrt(double{kSteps}));
    }
  }

  /// Of a run that begins so long after the session did.
  std::array<double, 4> at(double time_s) const {
    const double step = time_s / kSession_s * kSteps;
    const auto before = std::min(static_cast<std::size_t>(step), std::size_t{kSteps - 1});
    std::array<double, 4> zero = path_[before];
    for (std::size_t i = 0; i < 4; ++i)
      zero[i] += (step - static_cast<double>(before)) * (path_[before + 1][i] - zero[i]);
    return zero;
  }

 private:
  static constexpr int kSteps = 300;
  std::vector<std::array<double, 4>> path_;
};

struct Campaign {
  CampaignData data;
  std::vector<double> c_t, u_percent;  // truth by location "X0", "X1", …
};

Campaign make_campaign(const Scenario& s, std::mt19937_64& engine) {
  std::normal_distribution<double> unit;
  const auto normal = [&](double sigma) { return sigma * unit(engine); };
  Campaign campaign;
  CampaignData& data = campaign.data;
  data.info = parse_campaign_toml(reference_campaign_toml(), "campaign.toml");
  if (s.tachometer_rpm > 0) data.info.uncertainty.speed_rpm = s.tachometer_rpm;
  if (s.thermometer_K > 0) data.info.uncertainty.air_temperature_K = s.thermometer_K;

  // calibration bench
  std::array<double, 4> zero{}, gain{}, k{};
  std::vector<CalibrationPoint> points;
  std::vector<PropellerTest> tests;
  for (std::size_t i = 0; i < 4; ++i) {
    zero[i] = 0.34 + normal(0.02);
    gain[i] = 0.242 * (1 + normal(0.01));
    k[i] = 1 + (i < 2 ? -0.015 : 0.015) + normal(0.004);
  }
  const double k_mean = (k[0] + k[1] + k[2] + k[3]) / 4;
  for (std::size_t i = 0; i < 4; ++i) {
    k[i] /= k_mean;
    for (int p = 0; p < 10; ++p) {
      const double force = std::uniform_real_distribution<double>(4.9, 9.8)(engine);
      points.push_back({.cell = static_cast<int>(i) + 1,
                        .applied_force_N = force + normal(s.gauge_N),
                        .voltage_V = zero[i] + gain[i] * force + normal(s.reading_V),
                        .line = p + 2});
    }
    for (int p = 0; p < 4; ++p) {
      tests.push_back({.propeller = std::string(1, static_cast<char>('A' + i)),
                       .rotor = static_cast<int>(i) + 1,
                       .direction = i < 2 ? "CCW" : "CW",
                       .thrust_N = 7.4 * k[i] * (1 + normal(0.0015)),
                       .line = p + 2});
    }
  }
  data.certificate = calibrate(points, tests);

  // truth
  std::vector<double> scatter;
  for (int l = 0; l < s.locations; ++l) {
    campaign.c_t.push_back(0.107 * (1 + 0.05 * std::sin(1.7 * l)));
    campaign.u_percent.push_back(2 * std::cos(0.9 * l));
    scatter.push_back(s.uneven_scatter ? std::exp(0.9 * std::sin(2.3 * l)) : 1);
  }
  const double tachometer = normal(s.tachometer_rpm), thermometer = normal(s.thermometer_K);

  // sessions and their tares
  std::vector<double> session_factor, visit_factor;
  std::vector<Zeros> session_zero;
  const auto add_run = [&](const std::string& location, int session, int repeat, RunKind kind, double at_s,
                           const std::array<double, 4>& volts, double celsius) {
    Run run;
    run.run = "R" + std::to_string(data.runs.size());
    run.location = location;
    run.session = "S" + std::to_string(session);
    run.repeat = repeat;
    run.kind = kind;
    run.start_s = at_s;
    run.numbers["air_temperature_C"] = celsius;
    RunStatistics statistics{.hash = "h", .frames = 80000};
    for (std::size_t i = 0; i < 4; ++i) {
      const double noise = 2e-5;
      statistics.channels.push_back({.mean_V = volts[i] + normal(noise),
                                     .std_V = 0.05,
                                     .standard_error_V = noise,
                                     .lowest_V = 0.1,
                                     .highest_V = 3});
    }
    data.raw[run.run] = {.run = run.run, .state = RunState::kComplete, .frames = 80000, .hash = "h"};
    data.statistics[run.run] = statistics;
    data.runs.push_back(run);
  };
  for (int session = 0; session < s.sessions; ++session) {
    session_factor.push_back(1 + normal(s.session));
    std::array<double, 4> volts{};
    for (std::size_t i = 0; i < 4; ++i) volts[i] = zero[i] + (s.tares > 0 ? normal(0.003) : 0);
    session_zero.emplace_back(s, volts, engine);
    for (int tare = 0; tare < s.tares; ++tare) {
      const double at_s = kSession_s * tare / (s.tares - 1);
      add_run("OT", session, tare + 1, RunKind::kTare, 86400.0 * session + at_s, session_zero.back().at(at_s),
              20);
    }
  }

  // runs
  std::vector<std::vector<double>> visits(static_cast<std::size_t>(s.locations),
                                          std::vector<double>(static_cast<std::size_t>(s.sessions)));
  for (auto& row : visits) {
    for (double& factor : row) factor = 1 + normal(s.visit);
  }
  for (std::size_t l = 0; l < campaign.c_t.size(); ++l) {
    std::vector<int> choice(static_cast<std::size_t>(s.sessions));
    std::iota(choice.begin(), choice.end(), 0);
    std::shuffle(choice.begin(), choice.end(), engine);
    for (int repeat = 0; repeat < s.repeats; ++repeat) {
      const int session = choice[static_cast<std::size_t>(repeat % (s.visits > 0 ? s.visits : s.sessions))];
      const auto si = static_cast<std::size_t>(session);
      const double celsius = 20 + normal(2);
      const double omega = 2 * M_PI * (5000 + tachometer) / 60;  // set to 5000 by a tachometer that is off
      const double density = 101325 / (287.058 * (celsius + 273.15));
      const double total = campaign.c_t[l] * 0.5 * density * omega * omega * 0.1524 * 0.1524 * M_PI * 0.1524 *
                           0.1524 * session_factor[si] * visits[l][si] * (1 + normal(s.run * scatter[l]));
      const double at_s = std::fmod(7919.0 * static_cast<double>(data.runs.size()), kSession_s);
      std::array<double, 4> volts = session_zero[si].at(at_s);
      for (std::size_t i = 0; i < 4; ++i) {
        const double side = i == 0 || i == 3 ? 1 : -1;
        const double thrust =
            total / 4 * (1 + side * campaign.u_percent[l] / 100) * (1 + normal(s.rotor)) * k[i];
        volts[i] += gain[i] * thrust;
      }
      add_run("X" + std::to_string(l), session, repeat, RunKind::kThrust, 86400.0 * session + at_s, volts,
              celsius + thermometer);
    }
  }
  return campaign;
}

class Coverage : public testing::TestWithParam<Scenario> {};

TEST_P(Coverage, U95CoversTheTruthInNinetyThreeToNinetySevenPercent) {
  const std::uint64_t seed = test::seed();
  SCOPED_TRACE(seed);
  std::mt19937_64 engine(seed);
  constexpr int kCampaigns = 250;
  double c_t_covered = 0, u_covered = 0, total = 0;
  std::vector<double> c_t_by_campaign, u_by_campaign;
  for (int i = 0; i < kCampaigns; ++i) {
    const Campaign campaign = make_campaign(GetParam(), engine);
    const Summary summary = summarize_locations(campaign.data, reduce_runs(campaign.data, {}));
    double c_t_here = 0, u_here = 0;
    for (const LocationSummary& location : summary.locations) {
      const auto l = static_cast<std::size_t>(std::stoi(location.label.substr(1)));
      c_t_here += std::abs(location.c_t.mean - campaign.c_t[l]) <= location.c_t.u95 ? 1 : 0;
      u_here += std::abs(location.u_percent.mean - campaign.u_percent[l]) <= location.u_percent.u95 ? 1 : 0;
    }
    const auto n = static_cast<double>(summary.locations.size());
    c_t_covered += c_t_here;
    u_covered += u_here;
    total += n;
    c_t_by_campaign.push_back(c_t_here / n);
    u_by_campaign.push_back(u_here / n);
  }
  // Locations of one campaign share errors, so the uncertainty of the score comes from the campaigns.
  const auto error = [](const std::vector<double>& rates) {
    const double mean = std::accumulate(rates.begin(), rates.end(), 0.0) / static_cast<double>(rates.size());
    double square = 0;
    for (const double rate : rates) square += (rate - mean) * (rate - mean);
    return std::sqrt(square) / static_cast<double>(rates.size());
  };
  const double c_t_rate = c_t_covered / total, u_rate = u_covered / total;
  const double c_t_error = error(c_t_by_campaign), u_error = error(u_by_campaign);
  std::printf("%-28s C_T %.2f ± %.2f %%, U %.2f ± %.2f %%\n", GetParam().name, 100 * c_t_rate,
              100 * c_t_error, 100 * u_rate, 100 * u_error);
  EXPECT_GT(c_t_rate, 0.93 - 3 * c_t_error);
  EXPECT_LT(c_t_rate, 0.97 + 3 * c_t_error);
  EXPECT_GT(u_rate, 0.93 - 3 * u_error);
  EXPECT_LT(u_rate, 0.97 + 3 * u_error);
}

INSTANTIATE_TEST_SUITE_P(
    Designs, Coverage,
    testing::Values(
        Scenario{.name = "randomised"}, Scenario{.name = "no session scatter", .session = 0},
        Scenario{.name = "large session scatter", .session = 0.005},
        Scenario{.name = "two visits of five", .repeats = 10, .visits = 2},
        Scenario{.name = "two visits, visit scatter", .repeats = 10, .visits = 2, .visit = 0.002},
        Scenario{.name = "three repeats", .locations = 15, .repeats = 3, .sessions = 6},
        Scenario{.name = "calibration's own zero", .tares = 0},
        Scenario{.name = "instruments declared", .tachometer_rpm = 7.5, .thermometer_K = 0.5},
        Scenario{.name = "ordinary gauge", .gauge_N = 0.02, .reading_V = 0.002},
        Scenario{.name = "coarse gauge", .gauge_N = 0.1},
        Scenario{.name = "locations scatter unevenly", .repeats = 10, .uneven_scatter = true},
        Scenario{.name = "random walk of the zero", .tares = 3, .wander_V = 0.01},
        Scenario{.name = "drift of the zero", .drift_V = 0.02},
        Scenario{.name = "four sessions", .sessions = 4},
        Scenario{.name = "the thesis's size", .locations = 42, .repeats = 10, .sessions = 14, .visits = 2}),
    [](const auto& scenario) {
      std::string name = scenario.param.name;
      std::erase_if(name, [](char c) { return std::isalnum(static_cast<unsigned char>(c)) == 0; });
      return name;
    });

}  // namespace
}  // namespace tunnelrig
