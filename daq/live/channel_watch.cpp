#include "daq/live/channel_watch.h"

#include <algorithm>
#include <cmath>

namespace tunnelrig {

void ChannelWatch::add(const LiveFrame& frame) {
  for (std::size_t c = 0; c < sums_.size(); ++c) {
    Sums& sums = sums_[c];
    const std::int16_t value = frame.counts[c];
    sums.sum += value;
    sums.square += std::int64_t{value} * value;
    sums.low = count_ == 0 ? value : std::min(sums.low, value);
    sums.high = count_ == 0 ? value : std::max(sums.high, value);
    sums.clipped += value <= 0 || value >= highest_ ? 1 : 0;
  }
  if (++count_ < second_) return;
  const auto n = static_cast<double>(count_);
  for (std::size_t c = 0; c < sums_.size(); ++c) {
    const double mean = static_cast<double>(sums_[c].sum) / n;
    const double variance = static_cast<double>(sums_[c].square) / n - mean * mean;
    last_[c] = {mean, std::sqrt(std::max(0.0, variance)), sums_[c].low, sums_[c].high, sums_[c].clipped};
  }
  sums_ = {};
  count_ = 0;
  ready_ = true;
}

}  // namespace tunnelrig
