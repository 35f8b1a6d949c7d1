#include "flight/vehicle/random.h"

#include <cmath>

namespace tunnelrig {
namespace {

constexpr double kTail = 3.442619855899;            // where the tail begins
constexpr double kBlockArea = 9.91256303526217e-3;  // of every block

std::uint64_t splitmix(std::uint64_t& state) {
  std::uint64_t z = (state += 0x9e3779b97f4a7c15);
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9;
  z = (z ^ (z >> 27)) * 0x94d049bb133111eb;
  return z ^ (z >> 31);
}

}  // namespace

const Random::Ziggurat Random::kZiggurat;

Random::Ziggurat::Ziggurat() {
  double f = std::exp(-0.5 * kTail * kTail);
  x[0] = kBlockArea / f;
  x[1] = kTail;
  for (std::size_t i = 2; i < 128; ++i) {
    x[i] = std::sqrt(-2 * std::log(kBlockArea / x[i - 1] + f));
    f = std::exp(-0.5 * x[i] * x[i]);
  }
  x[128] = 0;
  for (std::size_t i = 0; i < 128; ++i) ratio[i] = x[i + 1] / x[i];
}

Random::Random(std::uint64_t seed, std::uint64_t stream) {
  std::uint64_t mixed_stream = stream;
  std::uint64_t state = seed ^ splitmix(mixed_stream);
  for (std::uint64_t& word : state_) word = splitmix(state);
}

double Random::edge(double u, std::size_t block) {
  for (;;) {
    if (block == 0) {  // Marsaglia's tail
      double x = 0, y = 0;
      do {
        x = std::log(1 - uniform()) / kTail;
        y = std::log(1 - uniform());
      } while (-2 * y < x * x);
      return u < 0 ? x - kTail : kTail - x;
    }
    const double x = u * kZiggurat.x[block];
    const double low = std::exp(-0.5 * (kZiggurat.x[block] * kZiggurat.x[block] - x * x));
    const double high = std::exp(-0.5 * (kZiggurat.x[block + 1] * kZiggurat.x[block + 1] - x * x));
    if (high + uniform() * (low - high) < 1) return x;
    const std::uint64_t word = bits();
    block = static_cast<std::size_t>(word & 127);
    u = static_cast<double>(word >> 11) * 0x1p-52 - 1;
    if (std::abs(u) < kZiggurat.ratio[block]) return u * kZiggurat.x[block];
  }
}

}  // namespace tunnelrig
