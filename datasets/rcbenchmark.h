// RCbenchmark/Tyto sweeps: CSV files whose headers carry their units.
#pragma once

#include "datasets/observations.h"

#include <filesystem>
#include <optional>

namespace tunnelrig {

struct SweepOptions {
  std::optional<double> propeller_diameter_m;
  std::optional<int> pole_count;     // where the speed column holds electrical revolutions
  std::filesystem::path sweeps_csv;  // what is known of each file: `file` and further columns
  std::filesystem::path schema;      // instead of the schema that the headers give
};

/// `import --format rcbenchmark`: one RCbenchmark/Tyto sweep or a folder of them, units in the header. The
/// rows are stacked under the columns `file`, those of `sweeps_csv`, and the sweeps' own; those without a
/// thrust are left out, and counted.
ObservationTable read_rcbenchmark(const std::filesystem::path& source, const SweepOptions& options);

}  // namespace tunnelrig
