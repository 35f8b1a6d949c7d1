// Which random numbers serve which question, so that no two are answered by the same data sets.
#pragma once

#include <cstdint>
#include <random>

namespace tunnelrig {

/// What data sets are drawn for: the place of the question in the search, from 1, is added to it.
enum class Draws : std::uint64_t {
  kEffects = 0,
  kCurves = 1'000,
  kStillFound = 4'000,
  kBends = 5'000,
  kRivals = 6'000,
};

/// What runs that are alike are drawn for, to hold those of the data against.
enum class ScatterDraws : std::uint64_t {
  kCorrelation = 3'000,
  kRotors = 4'000,
  kRuns = 5'000,
  kSessions = 6'000,
  kContrasts = 7'000,
};
inline constexpr std::uint64_t kDrawsOnAllRuns = 2'000;           // added once the seal is open
inline constexpr std::uint64_t kDrawsWithoutNormality = 500'000;  // added where runs keep their own sizes

inline std::mt19937_64 random_numbers(std::uint64_t seed, std::uint64_t stream) {
  constexpr std::uint64_t kApart = 1'000'003;  // of two seeds: a prime beyond all streams
  return std::mt19937_64(seed * kApart + stream);
}

inline std::mt19937_64 random_numbers(std::uint64_t seed, ScatterDraws what) {
  return random_numbers(seed, static_cast<std::uint64_t>(what));
}

}  // namespace tunnelrig
