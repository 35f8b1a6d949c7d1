// One run from a source into the campaign file: read, decode, account, store, sum up.
#pragma once

#include "daq/clock_fit.h"
#include "daq/packet_source.h"
#include "datasets/campaign_file.h"
#include "datasets/raw_store.h"
#include "datasets/run_summarizer.h"

#include <array>
#include <atomic>
#include <chrono>
#include <functional>
#include <iosfwd>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace tunnelrig {

struct LogSettings {
  double duration_s = 60;

  /// What was received longer ago than this is on the disk. With the time of a sync it keeps the promise that
  /// a kill costs at most the last 0.1 s.
  std::chrono::milliseconds commit_interval{75};

  /// Without a new frame for so long, and for three packets, the source counts as silent and is reopened;
  double silence_s = 1;
  double give_up_s = 30;  // and after so long the run ends as partial

  /// The bytes as received go here too, for `--source replay:FILE`; flushed when the run ends. That it cannot
  /// be written shows in its state, and leaves the recording alone.
  std::ostream* capture = nullptr;

  /// Sees every frame and gap as it is recorded, on the recording thread: it must not wait (daq/live/).
  FrameSink* watcher = nullptr;
};

struct LogProgress {
  double elapsed_s = 0;  // of the run, by the board's count of frames
  double duration_s = 0;
  bool silent = false;
  std::string instead;   // where silent: what arrives all the same and cannot be used; else empty
  std::string problem;   // where silent: why the board cannot be had, where its source says so
  bool waiting = false;  // to begin: another program is writing to the file, which has not got the run yet
  bool held_up = false;  // another program has been writing to the file for a while: the frames wait here
  std::array<double, 4> mean_counts{};  // of the frames so far
  const Ledger* ledger = nullptr;
  std::optional<ClockEstimate> clock;        // so far, of a source with a clock
  std::optional<std::uint64_t> ring_frames;  // the most that ever waited on the board, where it says so
};

struct LogOutcome {
  RunState state = RunState::kPartial;
  Ledger ledger;
  RunStatistics statistics;
  std::optional<ClockEstimate> clock;  // of a source with a clock, from ten seconds on
};

/// A run as it enters the sheet of runs: column and text, "run" among them.
using RunCells = std::vector<std::pair<std::string, std::string>>;

/// Records one run of int16 frames. The row and the raw run appear together at the start; frames follow,
/// durable within settings.commit_interval; statistics and state at the end. `progress` is called several
/// times a second, `stop` ends the run early (state partial).
///
/// While another program writes to the file, the run's begin waits, frames wait in memory (38 MB an hour),
/// and so does the end of the run. Throws InputError where the run exists or was stopped before it could
/// begin, StorageError where the disk is full or fails: everything committed before stays.
LogOutcome log_run(PacketSource& source, CampaignFile& file, const RunCells& run, const LogSettings& settings,
                   const SummarizerFactory& summarizer,
                   const std::function<void(const LogProgress&)>& progress, const std::atomic<bool>& stop);

}  // namespace tunnelrig
