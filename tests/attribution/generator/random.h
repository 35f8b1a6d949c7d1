// Draws of a generated campaign: one stream per purpose, so that a change of one leaves the others as they
// were.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <string_view>
#include <vector>

namespace tunnelrig::attribution {

class Random {
 public:
  Random(std::uint64_t seed, std::string_view purpose) {
    std::vector<std::uint32_t> words = {static_cast<std::uint32_t>(seed),
                                        static_cast<std::uint32_t>(seed >> 32)};
    for (const char c : purpose) words.push_back(static_cast<unsigned char>(c));
    std::seed_seq sequence(words.begin(), words.end());
    engine_.seed(sequence);
  }

  double uniform(double low, double high) {
    return low + (high - low) * std::ldexp(static_cast<double>(engine_() >> 11U), -53);
  }
  double log_uniform(double low, double high) { return std::exp(uniform(std::log(low), std::log(high))); }
  double normal(double sigma = 1) { return sigma * normal_(engine_); }
  double sign() { return uniform(0, 1) < 0.5 ? -1 : 1; }
  bool chance(double probability) { return uniform(0, 1) < probability; }
  std::size_t below(std::size_t count) {
    return std::min(count - 1, static_cast<std::size_t>(uniform(0, 1) * static_cast<double>(count)));
  }

  /// Student's t with `freedom` > 2 degrees of freedom, scaled to variance 1.
  double heavy(int freedom) {
    double chi_square = 0;
    for (int i = 0; i < freedom; ++i) {
      const double z = normal();
      chi_square += z * z;
    }
    return normal() / std::sqrt(chi_square / freedom) * std::sqrt((freedom - 2.0) / freedom);
  }

  template <typename T>
  void shuffle(std::vector<T>& items) {
    for (std::size_t i = items.size(); i > 1; --i) std::swap(items[i - 1], items[below(i)]);
  }

 private:
  std::mt19937_64 engine_;
  std::normal_distribution<double> normal_;
};

}  // namespace tunnelrig::attribution
