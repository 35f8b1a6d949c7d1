#include "daq/logger.h"

#include "daq/block_queue.h"
#include "daq/loss_ledger.h"
#include "daq/packet_decoder.h"
#include "daq/watchdog.h"
#include "datasets/error.h"
#include "datasets/statistics_store.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <ostream>
#include <thread>
#include <utility>

namespace tunnelrig {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t kReadSize = 65536;
constexpr std::size_t kQueueLimit = std::size_t{64} << 20;
constexpr std::chrono::milliseconds kReadTimeout{50};
constexpr std::chrono::milliseconds kReopenPause{250};
constexpr std::chrono::milliseconds kTick{20};
constexpr std::chrono::milliseconds kProgressInterval{200};
constexpr std::chrono::milliseconds kHeldUp{1000};

/// Reads on its own thread until the source ends or the queue closes, so that neither a slow disk nor a slow
/// sum makes a device's small buffer overflow.
class Reader {
 public:
  Reader(PacketSource& source, BlockQueue& queue)
      : source_(source), queue_(queue), thread_([this] { run(); }) {}
  ~Reader() {
    queue_.close();
    thread_.join();
  }
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;

  /// The recorder saw no new frame for a while: the reader tries to get the source back.
  void ask_to_reopen() { reopen_ = true; }

 private:
  void run() {
    source_.begin_run();
    std::vector<std::byte> buffer(kReadSize);
    ReadResult result;
    do {
      if (reopen_.exchange(false)) source_.reopen();
      result = source_.read(buffer, kReadTimeout);
      if (result.status == ReadResult::Status::kBroken) get_back();
    } while (queue_.push({result.status,
                          result.time_s,
                          {buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(result.size)},
                          result.cause}) &&
             result.status != ReadResult::Status::kEnd);
  }

  /// At once where it broke after a while; a peer that hangs up whenever it is called, or a device that is
  /// gone, is not asked all the time.
  void get_back() {
    std::this_thread::sleep_until(next_try_);
    next_try_ = Clock::now() + kReopenPause;
    source_.reopen();
  }

  PacketSource& source_;
  BlockQueue& queue_;
  std::atomic<bool> reopen_{false};
  Clock::time_point next_try_{};
  std::thread thread_;
};

/// Hands frames to the store and to the summary, and keeps the running means.
class RunSink : public FrameSink {
 public:
  RunSink(RawWriter& writer, RunSummarizer& summarizer, FrameSink* watcher)
      : writer_(writer), summarizer_(summarizer), watcher_(watcher) {}

  void frames(std::span<const std::byte> data) override {
    writer_.frames(data);
    summarizer_.frames(data);
    if (watcher_ != nullptr) watcher_->frames(data);
    std::array<std::int16_t, 4> frame{};
    for (std::size_t at = 0; at < data.size(); at += sizeof frame) {
      std::memcpy(frame.data(), data.data() + at, sizeof frame);
      for (std::size_t c = 0; c < frame.size(); ++c) sums_[c] += frame[c];
    }
    count_ += data.size() / sizeof frame;
  }

  void gap(const Gap& gap) override {
    writer_.gap(gap);
    summarizer_.gap(gap);
    if (watcher_ != nullptr) watcher_->gap(gap);
  }

  std::array<double, 4> means() const {
    std::array<double, 4> means{};
    for (std::size_t c = 0; c < means.size() && count_ > 0; ++c) {
      means[c] = static_cast<double>(sums_[c]) / static_cast<double>(count_);
    }
    return means;
  }

 private:
  RawWriter& writer_;
  RunSummarizer& summarizer_;
  FrameSink* watcher_;
  std::array<std::int64_t, 4> sums_{};
  std::uint64_t count_ = 0;
};

/// Packets into the tracker, stamped with the time of the block they came in.
class TrackerSink : public PacketSink {
 public:
  /// Before the first packet the longest that there may be is waited for.
  TrackerSink(LossTracker& tracker, FrameSink& sink, double rate_hz, const PacketSource& source)
      : tracker_(tracker),
        sink_(sink),
        source_(source),
        packet_s_(static_cast<double>(TRW_MAX_FRAMES) / rate_hz) {}
  void packet(const Packet& packet) override {
    const trw_header& header = packet.header;
    const auto run = source_.boundary();
    // Only at the run's start: later such numbers are those of a restart, which the tracker knows.
    if (run && tracker_.ledger().frames_stored == 0 && header.boot_id == run->boot_id &&
        header.first_sequence < run->first_sequence)
      return;
    const std::uint64_t stored = tracker_.ledger().frames_stored;
    tracker_.take(packet, time_s_, sink_);
    // What brings nothing new may be of another boot. A board may start again without a new id.
    if (tracker_.ledger().frames_stored > stored)
      clock_.add(static_cast<std::uint32_t>(tracker_.ledger().reboots),
                 header.first_ticks + (header.frame_count - std::uint64_t{1}) * header.ticks_per_frame,
                 header.tick_hz, header.ticks_per_frame, time_s_);
    if (header.tick_hz > 0)
      packet_s_ = static_cast<double>(header.frame_count) * header.ticks_per_frame / header.tick_hz;
  }
  double packet_s() const { return packet_s_; }  // that the last one spans
  const ClockFit& clock() const { return clock_; }
  void set_time(double time_s) { time_s_ = time_s; }

 private:
  LossTracker& tracker_;
  FrameSink& sink_;
  const PacketSource& source_;
  ClockFit clock_;
  double packet_s_, time_s_ = 0;
};

/// What arrived between two ledgers that brought no new frame; empty where it is nothing.
std::string unusable_between(const Ledger& before, const Ledger& now) {
  if (now.packets_corrupt > before.packets_corrupt)
    return fmt::format("{} packets with a wrong checksum or a number that is not believed",
                       now.packets_corrupt - before.packets_corrupt);
  const std::uint64_t old_frames = now.frames_duplicate + now.frames_late;
  if (const std::uint64_t known = before.frames_duplicate + before.frames_late; old_frames > known)
    return fmt::format("{} frames whose numbers have passed", old_frames - known);
  if (now.bytes_skipped > before.bytes_skipped)
    return fmt::format("{} bytes that are no packets of version 1", now.bytes_skipped - before.bytes_skipped);
  return "";
}

/// The recording thread's side of one run.
class Recording {
 public:
  Recording(CampaignFile& file, const std::string& run, const CampaignInfo& info, const LogSettings& settings,
            RunSummarizer& summarizer, const PacketSource& source)
      : settings_(settings),
        tracker_(settings.duration_s, info.daq.sample_rate_hz),
        file_(file),
        writer_(file, run, RawFormat{}, static_cast<std::size_t>(kChunk_s * info.daq.sample_rate_hz)),
        sink_(writer_, summarizer, settings.watcher),
        packets_(tracker_, sink_, info.daq.sample_rate_hz, source),
        watchdog_(settings.silence_s, settings.give_up_s),
        source_(source) {}

  /// Works until the run is complete or ends otherwise; returns the reason, empty where it is complete.
  std::string record(BlockQueue& queue, Reader& reader,
                     const std::function<void(const LogProgress&)>& progress, const std::atomic<bool>& stop) {
    while (!tracker_.complete()) {
      if (stop) return "stopped by the user";
      const bool was_silent = watchdog_.silent();
      if (const auto block = queue.pop(kTick)) {
        if (settings_.capture != nullptr)
          settings_.capture->write(reinterpret_cast<const char*>(block->bytes.data()),
                                   static_cast<std::streamsize>(block->bytes.size()));
        std::string end = take(*block, reader);
        if (!end.empty()) return end;
      }
      commit_when_due();
      if (watchdog_.silent() != was_silent) next_progress_ = {};
      report_when_due(progress);
    }
    return "";
  }

  void report_when_due(const std::function<void(const LogProgress&)>& progress) {
    if (Clock::now() < next_progress_) return;
    next_progress_ = Clock::now() + kProgressInterval;
    report(progress);
  }

  LogOutcome finish(RunSummarizer& summarizer, const std::string& end_reason) {
    LogOutcome outcome;
    outcome.state = end_reason.empty() ? RunState::kComplete : RunState::kPartial;
    end_reason_ = end_reason.empty() ? "complete" : end_reason;
    outcome.clock = packets_.clock().estimate();
    outcome.ledger = ledger();
    if (outcome.clock) {  // measured, not what it is meant to be
      outcome.ledger.board_rate_hz = outcome.clock->rate_hz;
      outcome.ledger.rate_interval_hz = outcome.clock->rate_interval_hz;
      outcome.ledger.drift_ppm_h = outcome.clock->drift_ppm_h;
      outcome.ledger.drift_interval_ppm_h = outcome.clock->drift_interval_ppm_h;
    }
    const std::string hash = writer_.finish(outcome.state, outcome.ledger);
    oldest_pending_ = Clock::time_point::max();
    outcome.statistics = summarizer.finish(hash);
    // Of no frames there is no lowest and no highest, which would look stuck.
    if (outcome.statistics.frames == 0) outcome.statistics.channels.clear();
    return outcome;
  }

  std::int64_t id() const { return writer_.id(); }

  void report(const std::function<void(const LogProgress&)>& progress) const {
    if (!progress) return;
    const Ledger now = ledger();
    progress({.elapsed_s = static_cast<double>(now.frames_emitted) / tracker_.rate_hz(),
              .duration_s = settings_.duration_s,
              .silent = watchdog_.silent(),
              .instead = watchdog_.silent() ? unusable_between(at_last_frame_, now) : "",
              .problem = watchdog_.silent() ? source_.problem() : "",
              .held_up = Clock::now() - oldest_pending_ > kHeldUp,
              .mean_counts = sink_.means(),
              .ledger = &now,
              .clock = packets_.clock().estimate(),
              .ring_frames = source_.ring_frames()});
  }

 private:
  /// The reason to end, or nothing.
  std::string take(const Block& block, Reader& reader) {
    packets_.set_time(block.time_s);
    if (block.cause != nullptr) tracker_.note_cause(block.cause);
    decoder_.push(block.bytes, packets_);
    if (const auto rate_hz = tracker_.changed_rate_hz())
      return fmt::format("the board's rate changed to {:.3f} frames/s", *rate_hz);
    if (block.status == ReadResult::Status::kEnd) {
      decoder_.finish(packets_);
      return tracker_.complete() ? "" : "the source ended";
    }
    if (tracker_.ledger().frames_stored != at_last_frame_.frames_stored) at_last_frame_ = ledger();
    switch (watchdog_.look(tracker_.ledger().frames_stored, block.time_s, packets_.packet_s())) {
      case Watchdog::Verdict::kFine:
        break;
      case Watchdog::Verdict::kBecameSilent:
        ++silences_;
        [[fallthrough]];
      case Watchdog::Verdict::kStillSilent:
        reader.ask_to_reopen();
        break;
      case Watchdog::Verdict::kGiveUp:
        return reason_to_give_up();
    }
    return "";
  }

  std::string reason_to_give_up() const {
    const std::string instead = unusable_between(at_last_frame_, ledger()), problem = source_.problem();
    return fmt::format("no {}frame for {:g} s{}{}", instead.empty() ? "" : "new ", settings_.give_up_s,
                       instead.empty() ? "" : ", only " + instead, problem.empty() ? "" : ": " + problem);
  }

  Ledger ledger() const {
    Ledger ledger = tracker_.ledger();
    ledger.packets_corrupt += decoder_.corrupt();
    ledger.bytes_skipped = decoder_.bytes_skipped();
    ledger.silences = silences_;
    ledger.end_reason = end_reason_;
    ledger.source = source_.name();
    if (const auto board = source_.board()) {
      ledger.board_serial = board->serial;
      ledger.conversions_per_frame = board->conversions_per_frame;
    }
    return ledger;
  }

  void commit_when_due() {
    if (!writer_.pending()) {
      oldest_pending_ = Clock::time_point::max();
      return;
    }
    const auto now = Clock::now();
    oldest_pending_ = std::min(oldest_pending_, now);
    if (now - oldest_pending_ < settings_.commit_interval) return;
    if (file_.atomically_if_free([&] { writer_.commit(ledger()); }))
      oldest_pending_ = Clock::time_point::max();
  }

  const LogSettings& settings_;
  PacketDecoder decoder_;
  LossTracker tracker_;
  CampaignFile& file_;
  RawWriter writer_;
  RunSink sink_;
  TrackerSink packets_;
  Watchdog watchdog_;
  const PacketSource& source_;
  std::uint64_t silences_ = 0;
  Ledger at_last_frame_;
  std::string end_reason_;
  Clock::time_point oldest_pending_ = Clock::time_point::max();
  Clock::time_point next_progress_{};
};

std::string name_of_run(const RunCells& cells) {
  const auto found =
      std::find_if(cells.begin(), cells.end(), [](const auto& cell) { return cell.first == "run"; });
  if (found == cells.end() || found->second.empty()) throw InputError("a run needs a name");
  return found->second;
}

}  // namespace

LogOutcome log_run(PacketSource& source, CampaignFile& file, const RunCells& run, const LogSettings& settings,
                   const SummarizerFactory& summarizer_factory,
                   const std::function<void(const LogProgress&)>& progress, const std::atomic<bool>& stop) {
  const CampaignInfo info = file.info();
  const auto summarizer = summarizer_factory(info, RawFormat{});
  std::optional<Recording> recording;
  const auto begin = [&] {
    file.append_row("runs", run);
    recording.emplace(file, name_of_run(run), info, settings, *summarizer, source);
  };
  const Ledger nothing_yet;
  for (auto next = Clock::now() + kHeldUp; !file.atomically_if_free(begin);) {
    if (stop)
      throw InputError(fmt::format(
          "{}: another program is writing to it; the run was stopped before it began", file.path().string()));
    if (progress && Clock::now() >= next) {
      progress({.duration_s = settings.duration_s, .waiting = true, .held_up = true, .ledger = &nothing_yet});
      next = Clock::now() + kProgressInterval;
    }
    source.idle();  // what it sends meanwhile is no part of the run
    std::this_thread::sleep_for(kTick);
  }
  std::string end_reason;
  {
    BlockQueue queue(kQueueLimit);
    Reader reader(source, queue);
    end_reason = recording->record(queue, reader, progress, stop);
  }
  if (settings.capture != nullptr) settings.capture->flush();
  LogOutcome outcome;
  const auto finish = [&] {
    outcome = recording->finish(*summarizer, end_reason);
    if (outcome.statistics.frames > 0) store_statistics(file, recording->id(), outcome.statistics);
  };
  while (!file.atomically_if_free(finish)) {
    recording->report_when_due(progress);
    std::this_thread::sleep_for(kTick);
  }
  recording->report(progress);
  return outcome;
}

}  // namespace tunnelrig
