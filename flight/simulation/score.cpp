#include "flight/simulation/score.h"

#include <cmath>

namespace tunnelrig {

void AxisErrors::add(const AxisErrors& other) {
  squares_ += other.squares_;
  largest_m_ = std::max(largest_m_, other.largest_m_);
  count_ += other.count_;
  for (std::size_t i = 0; i < kBins; ++i) bins_[i] += other.bins_[i];
}

double AxisErrors::rms_m() const {
  return count_ > 0 ? std::sqrt(squares_ / static_cast<double>(count_)) : 0;
}

double AxisErrors::quantile_m(double share) const {
  const double wanted = share * static_cast<double>(count_);
  double below = 0;
  for (std::size_t i = 0; i < kBins; ++i) {
    below += bins_[i];
    if (below >= wanted && count_ > 0) return std::min(static_cast<double>(i + 1) / kPerMetre, largest_m_);
  }
  return largest_m_;
}

double FlightScore::rms_m() const { return std::hypot(tracking[0].rms_m(), tracking[1].rms_m()); }

}  // namespace tunnelrig
