// Random numbers of a flight: the same for a seed on every machine and for every number of workers.
#pragma once

#include <array>
#include <cstdint>

namespace tunnelrig {

/// xoshiro256++ (Blackman and Vigna 2021), seeded through splitmix64. `stream` separates what must not share
/// numbers: runs of a Monte Carlo, or the sensors and the air of one run.
class Random {
 public:
  explicit Random(std::uint64_t seed, std::uint64_t stream = 0);

  std::uint64_t bits() {
    const std::uint64_t result = rotate(state_[0] + state_[3], 23) + state_[0];
    const std::uint64_t shifted = state_[1] << 17;
    state_[2] ^= state_[0];
    state_[3] ^= state_[1];
    state_[1] ^= state_[2];
    state_[0] ^= state_[3];
    state_[2] ^= shifted;
    state_[3] = rotate(state_[3], 45);
    return result;
  }

  /// [0, 1)
  double uniform() { return static_cast<double>(bits() >> 11) * 0x1p-53; }

  /// Standard normal: ziggurat of 128 blocks (Doornik 2005, ZIGNOR).
  double normal() {
    const std::uint64_t word = bits();
    const auto block = static_cast<std::size_t>(word & 127);
    const double u = static_cast<double>(word >> 11) * 0x1p-52 - 1;
    if ((u < 0 ? -u : u) < kZiggurat.ratio[block]) return u * kZiggurat.x[block];
    return edge(u, block);
  }

 private:
  struct Ziggurat {
    std::array<double, 129> x{};
    std::array<double, 128> ratio{};
    Ziggurat();
  };
  static const Ziggurat kZiggurat;

  static std::uint64_t rotate(std::uint64_t x, int k) { return (x << k) | (x >> (64 - k)); }
  double edge(double u, std::size_t block);

  std::array<std::uint64_t, 4> state_{};
};

}  // namespace tunnelrig
