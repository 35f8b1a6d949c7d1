#include "analysis/misread_runs.h"

#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>

namespace tunnelrig {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

constexpr double kZero_V = 0.4, kGain_V_per_N = 0.2;

/// Four rotors of about 7 N, sessions of a tare and five runs; the zeros wander from session to session.
struct MisreadRunsTest : testing::Test {
  CampaignData data;

  MisreadRunsTest() {
    data.certificate.emplace();
    data.certificate->propellers = PropellerFactors();
    for (int cell = 1; cell <= 4; ++cell)
      data.certificate->cells.push_back({.cell = cell, .zero_V = kZero_V, .gain_V_per_N = kGain_V_per_N});
    for (int session = 1; session <= 3; ++session)
      for (int k = 0; k < 6; ++k)
        add(fmt::format("R{}{}", session, k), k == 0 ? RunKind::kTare : RunKind::kThrust,
            k == 0 ? 0 : 6.8 + 0.1 * k, 0.3 * session);
  }
  void add(const std::string& name, RunKind kind, double thrust_N, double wandered_N) {
    tunnelrig::Run run;
    run.run = name;
    run.kind = kind;
    data.runs.push_back(run);
    data.raw[name] = {.run = name};
    RunStatistics& statistics = data.statistics[name];
    statistics.frames = 8000;
    statistics.channels.resize(4);
    for (ChannelStatistics& channel : statistics.channels) {
      channel.mean_V = kZero_V + kGain_V_per_N * (thrust_N + wandered_N);
      channel.standard_error_V = kGain_V_per_N * 0.01;
      channel.highest_V = 3;
    }
  }
  void load(const std::string& run, std::size_t rotors, double force_N) {
    for (std::size_t c = 0; c < rotors; ++c)
      data.statistics[run].channels[c].mean_V += kGain_V_per_N * force_N;
  }
};

TEST_F(MisreadRunsTest, OfASoundCampaignThereAreNone) {
  EXPECT_THAT(misread_runs(data).loaded_tares, IsEmpty());
  EXPECT_THAT(misread_runs(data).broken_off, IsEmpty());
  load("R20", 1, 5);
  EXPECT_THAT(misread_runs(data).loaded_tares, IsEmpty()) << "a cell whose zero has jumped is no motor";
}

TEST_F(MisreadRunsTest, ATareWithTheMotorsOnIsLoaded) {
  load("R20", 4, 7);
  EXPECT_THAT(misread_runs(data).loaded_tares, ElementsAre("R20"));
  data.runs[6].excluded = "motors on";
  EXPECT_THAT(misread_runs(data).loaded_tares, IsEmpty());
}

TEST_F(MisreadRunsTest, AZeroThatIsFarFromTheCalibrationsIsNoLoad) {
  for (const auto& run : data.runs) load(run.run, 4, 20);
  EXPECT_THAT(misread_runs(data).loaded_tares, IsEmpty());
}

TEST_F(MisreadRunsTest, ARunInWhichAMotorStopsIsNotOneState) {
  data.statistics["R13"].channels[2].standard_error_V = kGain_V_per_N * 1.5;
  EXPECT_THAT(misread_runs(data).broken_off, ElementsAre("R13"));
  data.certificate.reset();
  EXPECT_THAT(misread_runs(data).broken_off, IsEmpty());
}

}  // namespace
}  // namespace tunnelrig
