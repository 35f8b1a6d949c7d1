// Tares whose means cannot be used are no zeros, and are named.
#include "analysis/reduction.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

namespace tunnelrig {
namespace {

using testing::HasSubstr;

/// One session: a tare, a run of 7 N a rotor, a tare.
struct LeftOutTares : testing::Test {
  static constexpr double kZero_V = 0.4, kGain_V_per_N = 0.2, kThrust_N = 7;
  CampaignData data;

  LeftOutTares() {
    data.info = parse_campaign_toml(reference_campaign_toml(), "campaign.toml");
    data.certificate.emplace();
    data.certificate->propellers.factor = Eigen::VectorXd::Ones(4);
    for (int cell = 1; cell <= 4; ++cell)
      data.certificate->cells.push_back({.cell = cell, .zero_V = kZero_V, .gain_V_per_N = kGain_V_per_N});
    add("T1", RunKind::kTare, 0);
    add("R1", RunKind::kThrust, kThrust_N);
    add("T2", RunKind::kTare, 0);
  }
  void add(const std::string& name, RunKind kind, double force_N) {
    tunnelrig::Run run;
    run.run = name;
    run.kind = kind;
    run.session = "S1";
    run.location = "OT";
    run.start_s = 300.0 * static_cast<double>(data.runs.size());
    run.numbers["air_temperature_C"] = 20;
    data.runs.push_back(run);
    data.raw[name] = {.run = name, .state = RunState::kComplete, .hash = "h"};
    RunStatistics& statistics = data.statistics[name];
    statistics = {.hash = "h", .frames = 8000};
    for (int c = 0; c < 4; ++c)
      statistics.channels.push_back({.mean_V = kZero_V + kGain_V_per_N * force_N,
                                     .standard_error_V = 1e-5,
                                     .lowest_V = 0.1,
                                     .highest_V = 3});
  }
  /// As of an amplifier whose plug is out.
  void unplug(const std::string& run) {
    ChannelStatistics& channel = data.statistics.at(run).channels[1];
    channel.mean_V = channel.lowest_V = channel.highest_V = 0;
  }
  std::vector<std::string> left_out() const {
    std::vector<std::string> lines;
    for (const LeftOutRun& run : reduce_runs(data, {}).left_out)
      lines.push_back(fmt::format("{}: {} {}", run.run, run.reason, run.problem ? "!" : ""));
    return lines;
  }
  double thrust_N(std::size_t rotor) const { return reduce_runs(data, {}).runs.at(0).thrust_N[rotor]; }
};

TEST_F(LeftOutTares, SoundOnesAreZeros) {
  EXPECT_THAT(left_out(), testing::IsEmpty());
  EXPECT_NEAR(thrust_N(1), kThrust_N, 1e-9);
}

TEST_F(LeftOutTares, AnUnpluggedChannelIsNoZero) {
  unplug("T2");
  EXPECT_THAT(left_out(), testing::ElementsAre(HasSubstr("T2: channel 2 is stuck: it never changes")));
  EXPECT_NEAR(thrust_N(1), kThrust_N, 1e-9);
  unplug("T1");
  EXPECT_EQ(left_out().size(), 2u);
  EXPECT_NEAR(thrust_N(1), kThrust_N, 1e-9) << "by the calibration's zero";
  EXPECT_TRUE(reduce_runs(data, {}).runs.at(0).zero_from_calibration);
}

TEST_F(LeftOutTares, StatisticsOfOtherRawDataAreNone) {
  data.statistics.at("T1").hash = "of another";
  for (ChannelStatistics& channel : data.statistics.at("T1").channels) channel.mean_V += 0.1;
  data.statistics.erase("T2");
  EXPECT_THAT(left_out(), testing::ElementsAre(HasSubstr("T1: its statistics are of other raw data"),
                                               HasSubstr("T2: no statistics")));
  EXPECT_NEAR(thrust_N(1), kThrust_N, 1e-9);
}

TEST_F(LeftOutTares, APartialOneIsSaidAndNoProblem) {
  data.raw.at("T2").state = RunState::kPartial;
  EXPECT_THAT(left_out(), testing::ElementsAre(AllOf(HasSubstr("T2: its recording is partial"),
                                                     testing::Not(HasSubstr("!")))));
}

}  // namespace
}  // namespace tunnelrig
