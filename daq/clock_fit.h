// The board's clock held against the host's: what the sample rate really is.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

namespace tunnelrig {

struct ClockEstimate {
  double rate_hz = 0;           // frames per second of the host's clock
  double rate_interval_hz = 0;  // half of the 95 % interval
  double drift_ppm_h = 0;       // change of the rate
  double drift_interval_ppm_h = 0;
  double span_s = 0;  // over which it was fitted
};

/// Takes the time of every packet. A packet arrives late, never early, so that of each half second only the
/// one that came least late counts, and of these only what does not lie far above the lower edge of them all:
/// a backlog is late by seconds, and says nothing about the clock. Through the rest a line is fitted (the
/// rate), and a parabola (its drift). The intervals take the latenesses of different half seconds for
/// independent.
class ClockFit {
 public:
  /// `ticks` of the last frame of a packet, which arrived at `time_s`. Another `boot_id` begins a new fit.
  void add(std::uint32_t boot_id, std::uint64_t ticks, std::uint32_t tick_hz, std::uint32_t ticks_per_frame,
           double time_s);

  /// Nothing below ten seconds, where the source has no clock, where most half seconds came late, or where
  /// the rate's interval is wider than 0.1 %.
  std::optional<ClockEstimate> estimate() const;

 private:
  struct Point {
    double board_s, late_s;  // since the first packet; by how much the host's clock ran ahead of the board's
  };
  std::vector<Point> on_time() const;

  bool started_ = false;
  std::uint32_t boot_id_ = 0, tick_hz_ = 0, ticks_per_frame_ = 0;
  std::uint64_t first_ticks_ = 0;
  double first_time_s_ = 0;
  std::int64_t block_ = -1;
  std::vector<Point> points_;  // the least late of each block
};

}  // namespace tunnelrig
