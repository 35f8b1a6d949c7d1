#pragma once

#include "datasets/raw_data.h"

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace tunnelrig::test {

/// Text files of a small, valid campaign folder; a test changes what it is about and writes the folder.
struct ExampleCampaign {
  std::string campaign_toml;
  std::string calibration_csv;
  std::string propellers_csv;
  std::string runs_csv;

  /// Two sessions, three runs, counts that never clip.
  ExampleCampaign();

  /// Writes the texts and `raw/R1.npy` … of `frames` frames each.
  void write(const std::filesystem::path& folder, std::uint64_t frames = 400) const;
};

/// Bytes of `frames` frames of plausible counts that differ from frame to frame and channel to channel.
std::vector<std::byte> example_frames(std::uint64_t frames, std::uint32_t seed, const RawFormat& format = {});

/// Writes a .npy file.
void write_npy(const std::filesystem::path& path, const RawFormat& format, std::uint64_t frames,
               const std::vector<std::byte>& data);

}  // namespace tunnelrig::test
