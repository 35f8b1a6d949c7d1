// Where a chunk of raw data stands in the campaign file: run and first frame in one integer, so that a run's
// chunks are neighbours.
#pragma once

#include "datasets/error.h"

#include <cstdint>

#include <fmt/format.h>

namespace tunnelrig {

inline constexpr std::uint64_t kLastFrame = 0xFFFFFFFF;  // a key has 32 bits for the frame

/// Throws StorageError for a frame that is none of 32 bits: its key would be one of the next run's.
inline std::int64_t chunk_key(std::int64_t raw_run, std::uint64_t first_frame) {
  if (first_frame > kLastFrame)
    throw StorageError(
        fmt::format("a run holds {} frames at most; what is recorded beyond belongs in another run",
                    kLastFrame + 1),
        false);
  return (raw_run << 32) | static_cast<std::int64_t>(first_frame);
}

}  // namespace tunnelrig
