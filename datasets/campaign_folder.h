// The campaign folder: how a campaign enters and leaves as plain files (docs/campaign-folder.md).
#pragma once

#include "datasets/campaign_file.h"
#include "datasets/run_summarizer.h"

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace tunnelrig {

/// Called as work goes on: how many of how many runs are done.
using Progress = std::function<void(std::size_t done, std::size_t total)>;

struct ImportOptions {
  bool replace = false;      // discard the campaign that the file holds
  bool allow_stuck = false;  // take runs with a channel that never changes
  SummarizerFactory summarizer;
  Progress progress;
};

struct ImportSummary {
  std::size_t runs = 0;
  std::size_t raw_runs = 0;
  std::uint64_t frames = 0;
  std::uint64_t raw_bytes = 0;
  std::vector<std::string> doubts;  // import_doubts.h
};

/// Reads a campaign folder into a new campaign file. Throws InputError naming file, line and column at the
/// first broken rule; the file is then as it was before.
ImportSummary import_campaign_folder(const std::filesystem::path& folder, const std::filesystem::path& file,
                                     const ImportOptions& options);

/// Writes the campaign as a folder that must not exist, or be empty. Import of it gives the same campaign:
/// text cell by cell, array types, values and gaps. The folder appears whole or not at all.
/// Runs whose recording has not ended are in it as far as they got, excluded like every partial one; their
/// names are returned. Throws InputError naming what cannot be written, StorageError where raw data are
/// damaged.
std::vector<std::string> export_campaign_folder(const CampaignFile& file, const std::filesystem::path& folder,
                                                const Progress& progress);

}  // namespace tunnelrig
