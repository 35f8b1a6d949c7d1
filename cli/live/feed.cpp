#include "cli/live/feed.h"

#include "cli/live/run_alarms.h"
#include "datasets/recorded_rate.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <iterator>
#include <system_error>

#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace tunnelrig::live {
namespace {

constexpr std::size_t kRingFrames = 32768;  // 24 s of the rig
constexpr double kBin_s = 0.01;
constexpr double kBlock_s = 0.05;
constexpr std::chrono::milliseconds kTick{40};
constexpr std::chrono::milliseconds kState{250};
constexpr std::chrono::milliseconds kUnwatched{1000};
constexpr std::chrono::seconds kSpectrum{1};
constexpr std::chrono::seconds kDisk{5};

std::size_t whole_frames(double seconds, const CampaignInfo& info) {
  return std::max<std::size_t>(1, static_cast<std::size_t>(std::lround(seconds * info.daq.sample_rate_hz)));
}

}  // namespace

void lower_priority(int nice) {
  // Of this thread: Linux keeps a nice value for each.
  ::setpriority(PRIO_PROCESS, static_cast<id_t>(::syscall(SYS_gettid)), nice);
}

LiveFeed::View::View(const CampaignInfo& info, const LiveRun& of, std::uint32_t its_number)
    : run(of),
      number(its_number),
      frames_per_bin(std::max(1.0, kBin_s * info.daq.sample_rate_hz)),
      bins(frames_per_bin),
      blocks(whole_frames(kBlock_s, info)),
      watch(whole_frames(1, info), info.daq.highest_count()),
      window(kSpectrumFrames) {}

LiveFeed::LiveFeed(CampaignInfo info, std::filesystem::path campaign, Viewers& viewers, MeansFunction means)
    : info_(std::move(info)),
      campaign_(std::move(campaign)),
      viewers_(viewers),
      means_(std::move(means)),
      ring_(kRingFrames) {
  thread_ = std::thread([this] { work(); });
}

LiveFeed::~LiveFeed() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
    stop_.notify_all();
  }
  thread_.join();
}

void LiveFeed::begin(const LiveRun& run) {
  ring_.begin_run();
  const std::lock_guard lock(mutex_);
  shared_.position.phase = Phase::kRecording;
  shared_.position.run = run;
  shared_.run_number = ring_.run();
  shared_.progress = {};
  alarms_.begin_run();
}

void LiveFeed::progress(const LogProgress& progress) {
  const std::lock_guard lock(mutex_);
  shared_.progress = {.elapsed_s = progress.elapsed_s,
                      .silent = progress.silent,
                      .instead = progress.instead,
                      .problem = progress.problem,
                      .ledger = *progress.ledger,
                      .clock = progress.clock,
                      .ring_frames = progress.ring_frames};
}

std::string LiveFeed::end(const LogOutcome& outcome) {
  const std::lock_guard lock(mutex_);
  shared_.position.phase = Phase::kIdle;
  const LiveRun& run = shared_.position.run;
  if (run.kind == RunKind::kTare && outcome.state == RunState::kComplete)
    shared_.tare_ended[run.session] = std::chrono::steady_clock::now();
  return alarms_of(outcome, scale_of(*shared_.cells, info_, run.session), info_, alarms_.of_run());
}

void LiveFeed::place(const Position& position) {
  const std::lock_guard lock(mutex_);
  shared_.position = position;
}

Position LiveFeed::position() const {
  const std::lock_guard lock(mutex_);
  return shared_.position;
}

Position LiveFeed::raise_in_run(const std::string& run, std::atomic<bool>& flag) const {
  const std::lock_guard lock(mutex_);
  const Position& here = shared_.position;
  if (here.phase == Phase::kRecording && (run.empty() || run == here.run.run)) flag = true;
  return here;
}

void LiveFeed::know(CellKnowledge cells) {
  auto known = std::make_shared<const CellKnowledge>(std::move(cells));
  const std::lock_guard lock(mutex_);
  shared_.cells = std::move(known);
}

void LiveFeed::aim(const Target& target) {
  const std::lock_guard lock(mutex_);
  shared_.target = target;
}

Target LiveFeed::target() const {
  const std::lock_guard lock(mutex_);
  return shared_.target;
}

void LiveFeed::follow(const Position& position, const std::optional<Ledger>& ledger) {
  const std::lock_guard lock(mutex_);
  shared_.position = position;
  shared_.progress = {};
  if (!ledger) return;
  shared_.progress.ledger = *ledger;
  shared_.progress.elapsed_s =
      static_cast<double>(ledger->frames_emitted) / recorded_rate_hz(ledger, info_.daq.sample_rate_hz);
}

LiveFeed::Shared LiveFeed::shared() const {
  const std::lock_guard lock(mutex_);
  return shared_;
}

void LiveFeed::work() {
  lower_priority(5);
  auto next = std::chrono::steady_clock::now();
  while (true) {
    {
      std::unique_lock lock(mutex_);
      if (stop_.wait_until(lock, next, [&] { return stopping_; })) return;
    }
    const Time now = std::chrono::steady_clock::now();
    try {
      tick(now);
      tell_failure({}, now);
    } catch (const std::exception& error) {  // the recording goes on without a page, or with a poorer one
      try {
        tell_failure(error.what(), now);
      } catch (const std::exception&) {  // nor does it end where there is no memory to say so
      }
    }
    next = std::max(next + kTick, std::chrono::steady_clock::now());
  }
}

/// `why`: empty where all went well.
void LiveFeed::tell_failure(const std::string& why, Time now) {
  const std::lock_guard lock(mutex_);
  alarms_.set("display", 0, !why.empty(),
              fmt::format("this page is not up to date: {}; the recording goes on", why), now);
  if (!why.empty() && alarms_.settle(now)) viewers_.tell("alarms", alarms_.json());
}

void LiveFeed::tick(Time time) {
  taken_.clear();
  ring_.take(taken_);
  const Shared now = shared();  // after the frames, so that their run is known
  const Scale scale = scale_of(*now.cells, info_, now.position.run.session);
  take_frames(now);
  if (view_) send_frames(scale, now.position.phase != Phase::kRecording);
  if (time >= next_disk_) {
    next_disk_ = time + kDisk;
    std::error_code error;
    const auto space =
        std::filesystem::space(std::filesystem::absolute(campaign_, error).parent_path(), error);
    if (!error) disk_ = space;
  }
  const bool watched = viewers_.count() > 0;
  if (time >= next_spectrum_ && view_ && view_->window.full() && now.position.phase == Phase::kRecording) {
    next_spectrum_ = time + kSpectrum;
    send_spectrum(scale, now.position.run.speed_rpm);
  }
  const std::pair standing(now.position.phase, now.position.run.run);
  if (time < next_state_ && standing == told_) return;
  told_ = standing;
  next_state_ = time + (watched ? kState : kUnwatched);
  check(now, scale, time);
  viewers_.tell("state", state_json(now, scale));
}

/// Frames of a run that is not the one under way are its predecessor's last, or of one that began just now.
void LiveFeed::take_frames(const Shared& now) {
  for (const LiveFrame& frame : taken_) {
    if (!view_ || view_->number != frame.run) {
      if (frame.run != now.run_number) continue;
      view_.emplace(info_, now.position.run, now.run_number);
      shaft_hz_.reset();
    }
    view_->bins.add(frame);
    view_->blocks.add(frame);
    view_->watch.add(frame);
    view_->window.add(frame);
  }
}

void LiveFeed::send_frames(const Scale& scale, bool all) {
  const BinRange range = view_->bins.take(all);
  if (range.bins.empty() || viewers_.count() == 0) return;
  const double bin_s = view_->frames_per_bin / info_.daq.sample_rate_hz;
  fmt::memory_buffer out;
  const auto to = std::back_inserter(out);
  fmt::format_to(to, R"({{"run":"{}","t_s":{:.4f},"dt_s":{:.9g},"unit":"{}")", view_->run.run,
                 static_cast<double>(range.first) * bin_s, bin_s, scale.unit());
  for (const bool high : {false, true}) {
    fmt::format_to(to, ",\"{}\":[", high ? "high" : "low");
    for (std::size_t c = 0; c < static_cast<std::size_t>(info_.rig.rotors); ++c) {
      const bool upper = high == (scale.slope[c] >= 0);
      fmt::format_to(to, "{}[", c == 0 ? "" : ",");
      for (std::size_t i = 0; i < range.bins.size(); ++i) {
        const BinRange::Bin& bin = range.bins[i];
        const char* comma = i == 0 ? "" : ",";
        if (bin.empty)
          fmt::format_to(to, "{}null", comma);
        else
          fmt::format_to(to, "{}{:.5g}", comma, scale.value(c, upper ? bin.high[c] : bin.low[c]));
      }
      fmt::format_to(to, "]");
    }
    fmt::format_to(to, "]");
  }
  fmt::format_to(to, "}}");
  viewers_.show("frames", {out.data(), out.size()});
}

void LiveFeed::send_spectrum(const Scale& scale, std::optional<double> speed_rpm) {
  const LiveSpectrum spectrum = live_spectrum(view_->window, scale, at_speed(info_, speed_rpm));
  shaft_hz_ = spectrum.shaft_hz;
  if (viewers_.count() == 0) return;
  const double t_s = static_cast<double>(view_->window.frames().back().index) / info_.daq.sample_rate_hz;
  viewers_.show("spectrum", spectrum_json(spectrum, t_s, scale.unit()));
}

}  // namespace tunnelrig::live
