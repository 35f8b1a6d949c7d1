#include "support/example_campaign.h"

#include "datasets/campaign.h"
#include "datasets/npy.h"

#include <cstring>
#include <fstream>
#include <random>

#include <fmt/format.h>

namespace tunnelrig::test {
namespace {

void write_file(const std::filesystem::path& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

template <typename T>
std::vector<std::byte> frames_of(std::uint64_t frames, int channels, std::uint32_t seed, double scale) {
  std::mt19937 engine(seed);
  std::normal_distribution<double> noise(0, 30);
  std::vector<std::byte> data(frames * static_cast<std::uint64_t>(channels) * sizeof(T));
  for (std::uint64_t i = 0; i < frames * static_cast<std::uint64_t>(channels); ++i) {
    const double counts =
        2600 + 100 * static_cast<double>(i % static_cast<std::uint64_t>(channels)) + noise(engine);
    const auto value = static_cast<T>(counts * scale);
    std::memcpy(data.data() + i * sizeof(T), &value, sizeof(T));
  }
  return data;
}

}  // namespace

ExampleCampaign::ExampleCampaign()
    : campaign_toml(reference_campaign_toml()),
      calibration_csv("cell,sequence,applied_force_N,voltage_V\n"),
      propellers_csv(
          "propeller,rotor,direction,thrust_N\n"
          "A,1,CCW,7.40\nA,1,CCW,7.41\nB,2,CCW,7.45\nB,2,CCW,7.44\n"
          "C,3,CW,7.60\nC,3,CW,7.61\nD,4,CW,7.62\nD,4,CW,7.63\n"),
      runs_csv(
          "run,location,repeat,session,start_utc,raw,y_norm,z_norm,speed_rpm,air_temperature_C\n"
          "R1,OT,1,S1,2026-03-02T08:00:00Z,raw/R1.npy,0,0,5000.0,20.5\n"
          "R2,H4V-2,1,S1,2026-03-02T08:05:00Z,raw/R2.npy,0.8,-0.64,4999.0,20.7\n"
          "R3,OS,1,S2,2026-03-03T08:00:00Z,raw/R3.npy,,,5001.5,18.0\n") {
  for (int cell = 1; cell <= 4; ++cell) {
    for (int point = 1; point <= 10; ++point) {
      const double force = 4.9 + 0.49 * ((point * 7) % 11);
      const double wiggle = 0.001 * ((point * 5 + cell) % 7 - 3);
      calibration_csv +=
          fmt::format("{},{},{:.4f},{:.6f}\n", cell, point, force, 0.34 + 0.242 * force + wiggle);
    }
  }
}

void ExampleCampaign::write(const std::filesystem::path& folder, std::uint64_t frames) const {
  std::filesystem::create_directories(folder / "raw");
  write_file(folder / "campaign.toml", campaign_toml);
  write_file(folder / "calibration.csv", calibration_csv);
  if (!propellers_csv.empty()) write_file(folder / "propellers.csv", propellers_csv);
  write_file(folder / "runs.csv", runs_csv);
  for (std::uint32_t i = 1; i <= 3; ++i) {
    write_npy(folder / fmt::format("raw/R{}.npy", i), {}, frames, example_frames(frames, i));
  }
}

std::vector<std::byte> example_frames(std::uint64_t frames, std::uint32_t seed, const RawFormat& format) {
  const double volts_per_count = Daq{}.volts_per_count();
  switch (format.type) {
    case SampleType::kInt16:
      return frames_of<std::int16_t>(frames, format.channels, seed, 1);
    case SampleType::kUInt16:
      return frames_of<std::uint16_t>(frames, format.channels, seed, 1);
    case SampleType::kFloat32:
      return frames_of<float>(frames, format.channels, seed, volts_per_count);
    case SampleType::kFloat64:
      return frames_of<double>(frames, format.channels, seed, volts_per_count);
  }
  return {};
}

void write_npy(const std::filesystem::path& path, const RawFormat& format, std::uint64_t frames,
               const std::vector<std::byte>& data) {
  std::ofstream out(path, std::ios::binary);
  out << format_npy_header(format, frames);
  out.write(reinterpret_cast<const char*>(data.data()), static_cast<std::streamsize>(data.size()));
}

}  // namespace tunnelrig::test
