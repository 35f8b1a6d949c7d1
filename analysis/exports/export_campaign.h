// A campaign file for other people's programs: HDF5, MATLAB, CSV, NumPy (docs/exports.md).
#pragma once

#include "analysis/exports/contents.h"
#include "analysis/model/model_store.h"
#include "datasets/campaign_file.h"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace tunnelrig::exports {

enum class Format { kHdf5, kMat, kCsv, kNpy };

/// "hdf5", "mat", "csv" or "npy"; throws InputError.
Format format_from_name(std::string_view name);

/// What is exported beside the runs and what was recorded of them.
struct Parts {
  bool raw = true;           // counts, or volts, of every frame
  bool thrusts = true;       // calibrated, of every frame
  bool coefficients = true;  // of runs and locations
  bool maps = true;
  bool models = true;  // the calibration and the versions of the model
};

/// "raw,thrusts,coefficients,maps,models" in any order, or empty for all; throws InputError.
Parts parts_from_names(std::string_view names);

struct Settings {
  Format format = Format::kHdf5;
  Parts parts;
  ModelChoice model;            // that coefficients and maps go by
  std::string program_version;  // of the provenance, as the two below
  std::string arguments;
  std::string created_utc;
};

struct Exported {
  std::size_t recordings = 0;
  std::uint64_t frames = 0;
  std::uint64_t sample_bytes = 0;  // raw data that were read
  std::vector<Absent> absent;
};

using Progress = std::function<void(std::size_t done, std::size_t total)>;

/// Writes `target`, which must not exist (csv, npy: or be an empty folder): whole, or not at all. Recordings
/// are streamed in blocks. What the campaign does not give is left out and named in the result. Throws
/// InputError where the target cannot be taken or written (a full disk), StorageError where raw data are
/// damaged.
Exported export_campaign(const CampaignFile& file, const std::filesystem::path& target,
                         const Settings& settings, const Progress& progress = {});

}  // namespace tunnelrig::exports
