#pragma once

#include <cstdint>
#include <cstdlib>
#include <random>

namespace tunnelrig::test {

/// The seed of a randomised test: TUNNELRIG_TEST_SEED where it is set (to repeat a failure), 20260302
/// otherwise, so that the suite gives the same verdict on the same code. `TUNNELRIG_TEST_SEED=random` draws
/// one.
inline std::uint64_t seed() {
  static const std::uint64_t of_this_run = [] {
    const char* text = std::getenv("TUNNELRIG_TEST_SEED");
    if (text == nullptr) return std::uint64_t{20260302};
    const std::uint64_t value = std::strtoull(text, nullptr, 10);
    return value != 0 ? value : std::uint64_t{std::random_device{}()};
  }();
  return of_this_run;
}

}  // namespace tunnelrig::test
