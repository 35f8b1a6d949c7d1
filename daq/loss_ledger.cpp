#include "daq/loss_ledger.h"

#include "datasets/recorded_rate.h"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace tunnelrig {
namespace {

/// A jump of 2^40 frames is 26 years of the rig: such a number is not believed, whatever its checksum says.
constexpr std::uint64_t kImplausibleJump = std::uint64_t{1} << 40;
constexpr std::uint64_t kHighestSequence = std::uint64_t{1} << 62;

constexpr double kSameRate = 1e-3;  // what a device that measures its own period may vary by

/// Late frames are looked up in this many of the newest gaps.
constexpr std::ptrdiff_t kRememberedGaps = 256;

/// Frames that arrive again are held against so many of the newest, 49 s of the rig: more than any buffer
/// between it and here holds.
constexpr std::uint64_t kRememberedFrames = std::uint64_t{1} << 16;
constexpr std::uint64_t kNoFrame = ~std::uint64_t{0};

const std::uint8_t* frame_at(const Packet& packet, std::size_t index) {
  return reinterpret_cast<const std::uint8_t*>(packet.frames.data()) + index * TRW_FRAME_SIZE;
}

std::uint16_t status_of(const Packet& packet, std::size_t index) {
  return trw_get16(frame_at(packet, index) + 2 * TRW_CHANNELS);
}

/// What the board says of the frames before one with this status; null where it says nothing.
const char* cause_of(std::uint16_t status) {
  if ((status & TRW_STATUS_OVERRUN) != 0) return "overrun";
  return (status & TRW_STATUS_ADC_ERROR) != 0 ? "adc-error" : nullptr;
}

double rate_of(const trw_header& header) {
  return header.ticks_per_frame == 0 ? 0.0 : static_cast<double>(header.tick_hz) / header.ticks_per_frame;
}

/// A run of no frames would never be complete.
std::uint64_t frames_in(double duration_s, double rate_hz) {
  return static_cast<std::uint64_t>(std::max(1LL, std::llround(duration_s * rate_hz)));
}

}  // namespace

LossTracker::LossTracker(double duration_s, double expected_rate_hz)
    : frames_wanted_(frames_in(duration_s, expected_rate_hz)),
      wanted_s_(duration_s),
      rate_hz_(expected_rate_hz) {}

void LossTracker::start(const trw_header& header) {
  started_ = true;
  boot_id_ = header.boot_id;
  oldest_sequence_ = next_sequence_ = header.first_sequence;
  ledger_.boot_id = header.boot_id;
  ledger_.first_sequence = header.first_sequence;
  first_rate_hz_ = rate_of(header);
  if (first_rate_hz_ > 0) ledger_.board_rate_hz = first_rate_hz_;
  if (wanted_s_ > 0 && is_another_rate(ledger_.board_rate_hz, rate_hz_)) {
    rate_hz_ = first_rate_hz_;
    frames_wanted_ = frames_in(wanted_s_, rate_hz_);
  }
}

void LossTracker::lose(std::uint64_t frames, const char* cause, bool estimated, FrameSink& sink) {
  if (frames_wanted_ != 0) frames = std::min(frames, frames_wanted_ - ledger_.frames_emitted);
  if (frames == 0) return;
  ledger_.frames_lost += frames;
  ledger_.frames_emitted += frames;
  sink.gap(
      {.first_frame = ledger_.frames_stored, .frames_lost = frames, .cause = cause, .estimated = estimated});
}

/// Follows the board through a reboot. False where the packet is a straggler from before one.
bool LossTracker::follow_boot(const trw_header& header, double time_s, FrameSink& sink) {
  if (header.boot_id == boot_id_) return true;
  if (std::find(past_boots_.begin(), past_boots_.end(), header.boot_id) != past_boots_.end()) return false;
  past_boots_.push_back(boot_id_);
  boot_id_ = header.boot_id;
  begin_anew(header, time_s, sink);
  return true;
}

/// The board counts from 0 again.
void LossTracker::begin_anew(const trw_header& header, double time_s, FrameSink& sink) {
  ++ledger_.reboots;
  const double between = std::round((time_s - last_time_s_) * rate_of(header)) - header.frame_count;
  const auto by_clock = static_cast<std::uint64_t>(std::clamp(between, 0.0, 1e15));
  lose(std::max({by_clock, header.first_sequence, std::uint64_t{1}}),
       noted_cause_ != nullptr ? noted_cause_ : "reboot", true, sink);
  oldest_sequence_ = next_sequence_ = header.first_sequence;
  lost_ranges_.clear();
  newest_.clear();
  contradiction_end_.reset();
}

/// Whether a packet's numbers have passed and yet it is no copy of what was stored under them. Below the
/// first that was taken there is nothing to hold it against: a board that counts anew has not had the time
/// for more frames than that, and what a link sends again has a higher number.
bool LossTracker::contradicts(const Packet& packet, double time_s) const {
  const std::uint64_t first = packet.header.first_sequence;
  if (first >= next_sequence_ || newest_.empty()) return false;
  if (first + packet.header.frame_count <= oldest_sequence_ &&
      static_cast<double>(first) <= (time_s - last_time_s_) * first_rate_hz_)
    return true;
  if (next_sequence_ - first > kRememberedFrames) return true;
  for (std::size_t i = 0; i < packet.header.frame_count; ++i) {
    trw_frame frame;
    trw_get_frame(frame_at(packet, i), &frame);
    const Remembered& stored = newest_[(first + i) % kRememberedFrames];
    if (stored.sequence == first + i && !std::ranges::equal(stored.sample, frame.sample)) return true;
  }
  return false;
}

/// Follows a board that restarted with its old boot id, from the second packet on that gives it away: one
/// alone would move the count for ever. False where the packet must not be used.
bool LossTracker::follow_restart(const Packet& packet, double time_s, FrameSink& sink) {
  const std::uint64_t first = packet.header.first_sequence;
  if (contradiction_end_ == first) {
    --ledger_.packets_corrupt;  // the one before: its frames are in the gap now
    begin_anew(packet.header, time_s, sink);
    return true;
  }
  contradiction_end_.reset();
  if (!contradicts(packet, time_s)) return true;
  contradiction_end_ = first + packet.header.frame_count;
  ++ledger_.packets_corrupt;
  return false;
}

void LossTracker::take(const Packet& packet, double time_s, FrameSink& sink) {
  const trw_header& header = packet.header;
  if (complete() || changed_rate_hz_) return;
  const bool rebooted = started_ && header.boot_id != boot_id_;  // a new count, which began at 0
  if (header.first_sequence > (rebooted ? kImplausibleJump : kHighestSequence)) {
    ++ledger_.packets_corrupt;
    return;
  }
  if (!started_) start(header);
  if (std::abs(rate_of(header) - first_rate_hz_) > kSameRate * first_rate_hz_) {
    changed_rate_hz_ = rate_of(header);
    return;
  }
  if (!follow_boot(header, time_s, sink)) {
    ledger_.frames_late += header.frame_count;
    return;
  }
  const std::uint64_t first = header.first_sequence;
  if (first > next_sequence_ + kImplausibleJump) {
    ++ledger_.packets_corrupt;
    return;
  }
  if (!follow_restart(packet, time_s, sink)) return;
  std::size_t known = 0;  // frames of the packet whose numbers have passed already
  if (first < next_sequence_) {
    known = static_cast<std::size_t>(std::min<std::uint64_t>(next_sequence_ - first, header.frame_count));
    drop(first, known);
  } else if (first > next_sequence_) {
    const char* told = cause_of(status_of(packet, 0));
    lost_ranges_.emplace_back(next_sequence_, first);
    forget_oldest();
    const char* unknown = noted_cause_ != nullptr ? noted_cause_ : "lost";
    lose(first - next_sequence_, told != nullptr ? told : unknown, false, sink);
  }
  if (known < header.frame_count) {
    pass(packet, known, header.frame_count - known, sink);
    next_sequence_ = first + header.frame_count;
    last_time_s_ = time_s;
    noted_cause_ = nullptr;
  }
}

void LossTracker::pass(const Packet& packet, std::size_t first, std::size_t count, FrameSink& sink) {
  if (frames_wanted_ != 0) {
    count = static_cast<std::size_t>(std::min<std::uint64_t>(count, frames_wanted_ - ledger_.frames_emitted));
  }
  if (count == 0) return;
  samples_.clear();
  if (newest_.empty()) newest_.resize(kRememberedFrames, {.sequence = kNoFrame, .sample = {}});
  for (std::size_t i = first; i < first + count; ++i) {
    trw_frame frame;
    trw_get_frame(frame_at(packet, i), &frame);
    samples_.insert(samples_.end(), std::begin(frame.sample), std::end(frame.sample));
    const std::uint64_t sequence = packet.header.first_sequence + i;
    newest_[sequence % kRememberedFrames] = {.sequence = sequence, .sample = std::to_array(frame.sample)};
    if ((frame.status & TRW_STATUS_OVERRUN) != 0) ++ledger_.frames_overrun;
    if ((frame.status & TRW_STATUS_ADC_ERROR) != 0) ++ledger_.frames_adc_error;
    if ((frame.status & TRW_STATUS_CLIPPED_MASK) != 0) ++ledger_.frames_clipped;
    if ((frame.status & TRW_STATUS_TEST_PATTERN) != 0) ++ledger_.frames_test_pattern;
  }
  ledger_.frames_stored += count;
  ledger_.frames_emitted += count;
  sink.frames(std::as_bytes(std::span(samples_)));
}

/// Counts frames whose numbers have passed: late where they were booked as lost and now come for the first
/// time, duplicates otherwise.
void LossTracker::drop(std::uint64_t first_sequence, std::uint64_t count) {
  const std::uint64_t end_sequence = first_sequence + count;
  std::uint64_t late = 0;
  std::vector<std::pair<std::uint64_t, std::uint64_t>> left;
  for (const auto& [first, end] : lost_ranges_) {
    const std::uint64_t from = std::clamp(first_sequence, first, end),
                        to = std::clamp(end_sequence, first, end);
    late += to - from;
    if (first < from) left.emplace_back(first, from);
    if (to < end) left.emplace_back(to, end);
  }
  lost_ranges_ = std::move(left);
  forget_oldest();
  ledger_.frames_late += late;
  ledger_.frames_duplicate += count - late;
}

void LossTracker::forget_oldest() {
  if (std::ssize(lost_ranges_) > kRememberedGaps)
    lost_ranges_.erase(lost_ranges_.begin(), lost_ranges_.end() - kRememberedGaps);
}

}  // namespace tunnelrig
