#pragma once

#include <cstdint>
#include <cstdlib>
#include <random>

namespace tunnelrig::test {

/// The seed of a randomised test: TUNNELRIG_TEST_SEED where it is set (to repeat a failure), 20260302
/// otherwise, so that the suite gives the same verdict on the same code. `TUNNELRIG_TEST_SEED=random` draws
/// one.
inline std::uint64_t seed() {
  const char* text = std::getenv("TUNNELRIG_TEST_SEED");
  if (text == nullptr) return 20260302;
  const std::uint64_t value = std::strtoull(text, nullptr, 10);
  return value != 0 ? value : std::random_device{}();
}

}  // namespace tunnelrig::test
