// What the pages are sent while a campaign is recorded: traces, state, spectrum, alarms.
#pragma once

#include "cli/live/alarms.h"
#include "cli/live/live_spectrum.h"
#include "cli/live/means.h"
#include "cli/live/position.h"
#include "cli/live/scale.h"
#include "cli/live/viewers.h"
#include "daq/live/channel_watch.h"
#include "daq/live/display_bins.h"
#include "daq/live/frame_ring.h"
#include "daq/live/frame_window.h"
#include "daq/live/running_blocks.h"
#include "daq/logger.h"

#include <atomic>
#include <condition_variable>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace tunnelrig::live {

/// How well the operator wants a run to be known: U95 of its own noise.
struct Target {
  double c_t_u95 = 0.0005, u_percent_u95 = 0.3;
};

/// Watches the recording on a thread of its own, of lower priority. Frames come through a ring that drops
/// rather than waits; the rest is a few numbers five times a second.
class LiveFeed {
 public:
  LiveFeed(CampaignInfo info, std::filesystem::path campaign, Viewers& viewers, MeansFunction means);
  ~LiveFeed();
  LiveFeed(const LiveFeed&) = delete;
  LiveFeed& operator=(const LiveFeed&) = delete;

  // --- the logging thread

  /// What a run's frames are to pass through (LogSettings::watcher).
  FrameSink& watcher() { return ring_; }
  void begin(const LiveRun& run);
  void progress(const LogProgress& progress);
  /// The kinds of alarm that the run is to be marked with. Until the next `begin` or `place` nothing is
  /// recorded: what comes between is the report, or the next run's board.
  std::string end(const LogOutcome& outcome);
  void place(const Position& position);

  // --- any thread

  Position position() const;
  /// Raises `flag` if `run` (empty: whichever) is being recorded, without one ending and another beginning in
  /// between. Where things stood then.
  Position raise_in_run(const std::string& run, std::atomic<bool>& flag) const;
  void know(CellKnowledge cells);
  void aim(const Target& target);
  Target target() const;

  /// Of a run that another process records: what its ledger says (`serve`).
  void follow(const Position& position, const std::optional<Ledger>& ledger);

 private:
  using Time = std::chrono::steady_clock::time_point;

  struct Progress {
    double elapsed_s = 0;
    bool silent = false;
    std::string instead, problem;  // as in LogProgress
    Ledger ledger;
    std::optional<ClockEstimate> clock;
    std::optional<std::uint64_t> ring_frames;
  };

  /// What other threads set.
  struct Shared {
    Position position;
    std::uint32_t run_number = 0;  // of the ring
    Progress progress;
    std::shared_ptr<const CellKnowledge> cells = std::make_shared<CellKnowledge>();
    Target target;
    std::map<std::string, Time> tare_ended;  // by session, where it was this process that recorded it
  };

  /// One run as it is watched.
  struct View {
    View(const CampaignInfo& info, const LiveRun& of, std::uint32_t its_number);
    LiveRun run;
    std::uint32_t number;
    double frames_per_bin;
    DisplayBins bins;
    RunningBlocks blocks;
    ChannelWatch watch;
    FrameWindow window;
  };

  Shared shared() const;
  void work();
  void tick(Time now);
  void tell_failure(const std::string& why, Time now);
  void take_frames(const Shared& now);
  void send_frames(const Scale& scale, bool all);
  void send_spectrum(const Scale& scale, std::optional<double> speed_rpm);
  void check(const Shared& now, const Scale& scale, Time time);
  void check_channels(const Shared& now, const Scale& scale, Time time);
  static std::optional<double> tare_age_s(const Shared& now);
  std::string state_json(const Shared& now, const Scale& scale) const;

  CampaignInfo info_;
  std::filesystem::path campaign_;
  Viewers& viewers_;
  MeansFunction means_;
  FrameRing ring_;

  mutable std::mutex mutex_;  // guards shared_, alarms_ and stopping_
  Shared shared_;
  Alarms alarms_;
  bool stopping_ = false;
  std::condition_variable stop_;

  // the feed's own thread only
  std::vector<LiveFrame> taken_;
  std::optional<View> view_;
  std::optional<double> shaft_hz_;
  std::filesystem::space_info disk_{};  // all 0: not known yet
  Time next_state_{}, next_spectrum_{}, next_disk_{};
  std::pair<Phase, std::string> told_{Phase::kIdle, ""};  // phase and run of the last state
  std::thread thread_;
};

/// Of a disk that is known; a full one has none left.
bool is_low(const std::filesystem::space_info& disk);

/// Lets every other thread go first.
void lower_priority(int nice);

}  // namespace tunnelrig::live
