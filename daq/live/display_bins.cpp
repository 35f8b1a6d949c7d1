#include "daq/live/display_bins.h"

#include <algorithm>

namespace tunnelrig {

void DisplayBins::add(const LiveFrame& frame) {
  const auto number = static_cast<std::uint64_t>(static_cast<double>(frame.index) / frames_per_bin_);
  if (bins_.empty() || bins_.back().number != number) {
    bins_.push_back({number, {.empty = false, .low = frame.counts, .high = frame.counts}});
    if (bins_.size() > kMostBins) bins_.pop_front();
    return;
  }
  BinRange::Bin& bin = bins_.back().bin;
  for (std::size_t c = 0; c < frame.counts.size(); ++c) {
    bin.low[c] = std::min(bin.low[c], frame.counts[c]);
    bin.high[c] = std::max(bin.high[c], frame.counts[c]);
  }
}

BinRange DisplayBins::take(bool all) {
  const std::size_t complete = bins_.size() - (all || bins_.empty() ? 0 : 1);
  if (complete == 0) return {};
  std::size_t first = complete - 1;
  const std::uint64_t last = bins_[first].number;
  while (first > 0 && last - bins_[first - 1].number < kMostBins) --first;
  BinRange range{.first = bins_[first].number, .bins = {}};
  range.bins.resize(last - range.first + 1);
  for (std::size_t i = first; i < complete; ++i) range.bins[bins_[i].number - range.first] = bins_[i].bin;
  bins_.erase(bins_.begin(), bins_.begin() + static_cast<std::ptrdiff_t>(complete));
  return range;
}

}  // namespace tunnelrig
