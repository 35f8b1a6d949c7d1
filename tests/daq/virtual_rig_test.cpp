#include "daq/virtual_rig.h"

#include "daq/logging.h"
#include "daq/virtual_weather.h"
#include "datasets/error.h"
#include "datasets/thesis.h"
#include "tunnelrig_wire.h"

#include <cmath>
#include <cstring>

#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

const CampaignInfo kCampaign = parse_campaign_toml(reference_campaign_toml(), "campaign.toml");

VirtualRunRequest request(const std::string& location, int repeat = 1) {
  return {.session = "S1",
          .location = location,
          .repeat = repeat,
          .start_s = 1772438400,
          .session_start_s = 1772438400};
}

std::vector<std::byte> first_bytes(const VirtualRig& rig, const VirtualRunRequest& run) {
  const auto board = rig.board(run, 0, {});
  std::vector<std::byte> bytes(400000);  // some 24 s
  std::size_t size = 0;
  while (size < bytes.size())
    size += board->read(std::span(bytes).subspan(size), std::chrono::milliseconds(50)).size;
  return bytes;
}

TEST(VirtualRig, IsAFunctionOfSeedAndRun) {
  const VirtualRig rig(kCampaign, {.seed = 5}), same(kCampaign, {.seed = 5}), other(kCampaign, {.seed = 6});
  EXPECT_EQ(first_bytes(rig, request("H4V-2")), first_bytes(same, request("H4V-2")));
  EXPECT_NE(first_bytes(rig, request("H4V-2")), first_bytes(other, request("H4V-2")));
  EXPECT_NE(first_bytes(rig, request("H4V-2")), first_bytes(rig, request("H4V-2", 2)));
  EXPECT_EQ(format_csv(rig.calibration_bench()), format_csv(same.calibration_bench()));
}

TEST(VirtualRig, KnowsItsPlaces) {
  const VirtualRig rig(kCampaign, {});
  for (const char* good : {"OT", "H0V0", "H5V3", "OS", "GND0.75", "CEIL5"})
    EXPECT_NO_THROW(rig.board(request(good), 0, {}));
  for (const char* bad : {"H9V0", "GND", "GND-1", "moon"})
    EXPECT_THROW(rig.board(request(bad), 0, {}), InputError) << bad;
}

TEST(VirtualRig, RunsInRealTimeWhenAsked) {
  // The board's clock starts somewhere between these two, and every bound holds however long this thread is
  // kept waiting.
  const double before_s = steady_seconds();
  const VirtualRig rig(kCampaign, {});
  const auto board = rig.board(request("OT"), 1, {});
  const double after_s = steady_seconds();
  std::vector<std::byte> bytes(100000);
  std::size_t size = 0;
  double last_read_s = after_s;
  while (last_read_s - after_s < 0.5) {
    last_read_s = steady_seconds();
    size += board->read(bytes, std::chrono::milliseconds(20)).size;
  }
  const double frames = static_cast<double>(size) / static_cast<double>(trw_packet_size(16)) * 16;
  EXPECT_GE(frames, (last_read_s - after_s) * kCampaign.daq.sample_rate_hz - 16);
  EXPECT_LE(frames, (steady_seconds() - before_s) * kCampaign.daq.sample_rate_hz);
}

TEST(VirtualRig, ScatterBetweenRunsIsThePublishedOne) {
  // By hand from the converter's counts: what the instruments and the bench cannot know drops out of a
  // relative scatter.
  const VirtualRig rig(kCampaign, {.seed = 11});
  std::vector<double> thrust;
  for (int repeat = 1; repeat <= 60; ++repeat) {
    VirtualRunRequest run = request("OS", repeat);
    const auto bytes = first_bytes(rig, run);
    double sum = 0;
    std::size_t count = 0;
    for (std::size_t at = 0; at + trw_packet_size(16) <= bytes.size(); at += trw_packet_size(16)) {
      for (std::size_t i = 0; i < 16; ++i, ++count) {
        trw_frame frame{};
        trw_get_frame(
            reinterpret_cast<const std::uint8_t*>(bytes.data()) + at + TRW_HEADER_SIZE + i * TRW_FRAME_SIZE,
            &frame);
        for (const std::int16_t counts : frame.sample) sum += counts * kCampaign.daq.volts_per_count() - 0.34;
      }
    }
    thrust.push_back(sum / static_cast<double>(count));
  }
  double mean = 0, square = 0;
  for (const double t : thrust) mean += t / 60;
  for (const double t : thrust) square += (t - mean) * (t - mean) / 59;
  const double published = thesis::kCtOpenSpaceStd / thesis::kCtOpenSpace;
  EXPECT_NEAR(std::sqrt(square) / mean, published,
              0.3 * published);  // 60 runs know σ to 9 %; the turbulence of 24 s adds little
}

TEST(VirtualWeather, StaysWhereWeatherIs) {
  double lowest = 1e9, highest = 0;
  for (int hour = 0; hour < 24 * 30; ++hour) {
    const Weather weather = weather_at(1772438400 + 3600.0 * hour, 3);
    lowest = std::min(lowest, weather.air_pressure_Pa);
    highest = std::max(highest, weather.air_pressure_Pa);
    EXPECT_TRUE(weather.air_temperature_C > 5 && weather.air_temperature_C < 35);
    EXPECT_TRUE(weather.relative_humidity > 0 && weather.relative_humidity < 1);
  }
  EXPECT_GT(highest - lowest, 800);
  EXPECT_LT(highest - lowest, 6000);
  EXPECT_NEAR(true_air_density({20, 101325, 0}), 1.2041, 0.0005);
}

}  // namespace
}  // namespace tunnelrig
