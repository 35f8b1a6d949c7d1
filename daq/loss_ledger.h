// Packets to frames without a silent loss: numbers decide what was lost, doubled or late.
#pragma once

#include "daq/packet_decoder.h"
#include "datasets/raw_store.h"

#include <array>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

namespace tunnelrig {

/// Follows the sequence numbers of one run. Every frame between the first one seen and the last is either
/// passed on or in a gap; frames come out in ascending order, so a frame that arrives behind a later one is
/// counted and dropped.
///
/// A change of the boot id is a reboot: a gap whose length comes from the time between the packets
/// (`estimated`), because the board's own count starts anew. So are two packets in a row whose numbers have
/// passed while their frames are not those that were recorded: a board that draws no new boot id.
/// docs/loss-ledger.md.
class LossTracker {
 public:
  /// The run ends when `frames_wanted` frames are accounted for (stored or lost); 0: never.
  explicit LossTracker(std::uint64_t frames_wanted) : frames_wanted_(frames_wanted) {}

  /// The run ends when `duration_s` of frames are accounted for: by `expected_rate_hz`, or, where the board
  /// says another by more than 0.1 %, by that.
  LossTracker(double duration_s, double expected_rate_hz);

  /// By which the run's frames are seconds.
  double rate_hz() const { return rate_hz_; }

  /// Takes a packet that was received at `time_s`; passes its frames (int16 × 4) and the gap before them to
  /// `sink`.
  void take(const Packet& packet, double time_s, FrameSink& sink);

  /// What the source says went wrong just now: the cause of the next gap, unless the board knows better. A
  /// static text.
  void note_cause(const char* cause) { noted_cause_ = cause; }

  /// Frames per second of a packet that were not those of the run's first one, by more than 0.1 %: from there
  /// on nothing is taken, since a run has one rate.
  std::optional<double> changed_rate_hz() const { return changed_rate_hz_; }

  bool complete() const { return frames_wanted_ != 0 && ledger_.frames_emitted >= frames_wanted_; }

  /// The sums so far. The counts that only others know (corrupt packets, silences) are theirs to fill in.
  const Ledger& ledger() const { return ledger_; }

 private:
  void start(const trw_header& header);
  bool follow_boot(const trw_header& header, double time_s, FrameSink& sink);
  bool follow_restart(const Packet& packet, double time_s, FrameSink& sink);
  bool contradicts(const Packet& packet, double time_s) const;
  void begin_anew(const trw_header& header, double time_s, FrameSink& sink);
  void lose(std::uint64_t frames, const char* cause, bool estimated, FrameSink& sink);
  void pass(const Packet& packet, std::size_t first, std::size_t count, FrameSink& sink);
  void drop(std::uint64_t first_sequence, std::uint64_t count);
  void forget_oldest();

  std::uint64_t frames_wanted_;
  double wanted_s_ = 0, rate_hz_ = 0;
  double first_rate_hz_ = 0;
  std::optional<double> changed_rate_hz_;
  Ledger ledger_;
  bool started_ = false;
  std::uint32_t boot_id_ = 0;
  std::vector<std::uint32_t> past_boots_;
  std::uint64_t oldest_sequence_ = 0;  // of this boot: below it nothing was ever taken
  std::uint64_t next_sequence_ = 0;
  const char* noted_cause_ = nullptr;
  double last_time_s_ = 0;
  std::vector<std::pair<std::uint64_t, std::uint64_t>>
      lost_ranges_;                    // [first, end) of this boot that never came, newest last
  std::vector<std::int16_t> samples_;  // of one packet

  struct Remembered {
    std::uint64_t sequence;
    std::array<std::int16_t, TRW_CHANNELS> sample;
  };
  std::vector<Remembered> newest_;                  // stored frames of this boot, by their number
  std::optional<std::uint64_t> contradiction_end_;  // where a packet that contradicts them ended, just now
};

}  // namespace tunnelrig
