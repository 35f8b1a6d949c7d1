// `log --live`: the same recording, steered from a page.
#include "cli/console.h"
#include "cli/live/live_session.h"
#include "cli/logging.h"
#include "datasets/error.h"
#include "datasets/locations.h"
#include "datasets/run_marks.h"

#include <algorithm>
#include <chrono>

#include <fmt/format.h>

namespace tunnelrig::cli {
namespace {

using live::LiveRun;
using live::Phase;

live::LiveSettings live_settings(const LogOptions& options, Logging& logging, std::vector<PlannedRun> plan) {
  live::LiveSettings settings{.campaign = options.db,
                              .info = logging.info(),
                              .plan = std::move(plan),
                              .source = options.source,
                              .program = "tunnelrig " + program_version(),
                              .address = options.listen.empty() ? "127.0.0.1" : options.listen,
                              .port = *options.live_port,
                              .metadata = {}};
  for (const auto& [column, option, value] : kConditionOptions)
    settings.metadata.emplace(column, options.*value);
  return settings;
}

/// The loop that logs: one run at a time, what the plan or the page says.
class LiveLogging {
 public:
  explicit LiveLogging(const LogOptions& options)
      : options_(options),
        plan_(options.plan.empty() ? std::vector<PlannedRun>() : read_plan(options.plan)),
        logging_(options),
        page_(live_settings(options, logging_, plan_), stop_requested) {
    left_ = runs_left(logging_.file(), plan_);
    here_ = {.location = options.location, .session = options.session, .duration_s = options.duration_s};
    if (const auto runs = logging_.file().runs(); here_.session.empty() && !runs.empty())
      here_.session = runs.back().session;
  }

  int run() {
    fmt::print("live page: {}\n", page_.address());
    if (!plan_.empty())
      fmt::print("{}: {} of {} runs to record\n", options_.plan, left_.size(), plan_.size());
    std::fflush(stdout);
    if (!options_.location.empty()) record_unasked(asked_on_the_command_line());
    while (!quit_requested) {
      if (!left_.empty() && may_go_on()) {
        const PlannedRun next = left_.front();
        record_unasked(next);
        if (options_.yes) have_tried(next);
        continue;
      }
      place(!left_.empty() ? Phase::kWaiting : plan_.empty() ? Phase::kIdle : Phase::kFinished);
      if (left_.empty() && options_.yes) break;
      logging_.idle();
      if (const auto order = page_.desk().wait(std::chrono::milliseconds(100))) carry_out(*order);
    }
    return code_;
  }

 private:
  PlannedRun asked_on_the_command_line() const {
    return {.session = options_.session.empty() ? session() : options_.session,
            .kind = options_.kind == "tare" ? RunKind::kTare : RunKind::kThrust,
            .location = options_.location,
            .repeat = options_.repeat,
            .duration_s = options_.duration_s};
  }

  /// Nobody has to move the rig, and nobody stopped the last run.
  bool may_go_on() const {
    if (options_.yes) return true;
    const PlannedRun& next = left_.front();
    return complete_ && !here_.run.empty() && here_.location == next.location && here_.kind == next.kind &&
           here_.session == next.session;
  }

  /// With --yes a plan is walked once, as without a page: of a board that is dead every try would be partial.
  void have_tried(const PlannedRun& run) {
    std::erase_if(plan_, [&](const PlannedRun& planned) { return key_of(planned) == key_of(run); });
    left_ = runs_left(logging_.file(), plan_);
  }

  std::string session() const { return here_.session.empty() ? "S1" : here_.session; }

  void place(Phase phase) {
    const std::string next = left_.empty() ? "" : left_.front().location;
    const auto key = std::pair(phase, next);
    if (placed_ == key) return;
    placed_ = key;
    live::Position position{.phase = phase, .run = here_, .next_location = next};
    page_.feed().place(position);
    page_.book().look();
  }

  void found_problem(const std::string& what) {
    warn(what);
    code_ = std::max<int>(code_, kProblemFound);
  }

  void carry_out(live::Order& order) {
    const live::Command& command = order.command;
    try {
      if (command.name == "redo") {
        redo(order);
      } else if (command.name == "tare") {
        record(tare(command), &order);
      } else if (command.name == "start" && !command.location.empty()) {
        record(started(command), &order);
      } else if (!left_.empty()) {
        record(left_.front(), &order);
      } else {
        throw InputError(plan_.empty() ? "there is no plan; name a location to start a run"
                                       : "the plan is finished; name a location for one more run");
      }
    } catch (const InputError& error) {
      order.answer({.problem = error.what(), .text = ""});
    } catch (const StorageError& error) {
      if (error.disk_full()) throw;
      found_problem(error.what());
      order.answer({.problem = error.what(), .text = ""});
    }
  }

  /// A run that nobody's command is waiting for.
  void record_unasked(const PlannedRun& planned) {
    try {
      record(planned, nullptr);
    } catch (const InputError& error) {
      found_problem(error.what());
    }
  }

  int next_repeat(const std::string& location, RunKind kind) {
    int repeat = 0;
    for (const Run& run : logging_.file().runs()) {
      if (run.location == location && run.kind == kind) repeat = std::max(repeat, run.repeat);
    }
    return repeat + 1;
  }

  PlannedRun started(const live::Command& command) {
    const RunKind kind = command.kind.value_or(RunKind::kThrust);
    return {.session = command.session.empty() ? session() : command.session,
            .kind = kind,
            .location = command.location,
            .repeat = command.repeat ? *command.repeat : next_repeat(command.location, kind),
            .duration_s = command.duration_s.value_or(options_.duration_s)};
  }

  /// Where the rig stands, in the session under way; before the first run, where the plan begins.
  PlannedRun tare(const live::Command& command) {
    const bool at_plan = here_.run.empty() && !left_.empty();
    PlannedRun run{.session = at_plan ? left_.front().session : session(),
                   .kind = RunKind::kTare,
                   .location = at_plan                  ? left_.front().location
                               : here_.location.empty() ? "OT"
                                                        : here_.location,
                   .duration_s = command.duration_s.value_or(options_.duration_s)};
    if (!command.location.empty()) run.location = command.location;
    if (!command.session.empty()) run.session = command.session;
    run.repeat = next_repeat(run.location, RunKind::kTare);
    return run;
  }

  /// The same run once more, in the session under way; the first one is left out once there is a better one.
  void redo(live::Order& order) {
    const auto runs = logging_.file().runs();
    const std::string name = order.command.run.empty() ? here_.run : order.command.run;
    const auto old = std::find_if(runs.begin(), runs.end(), [&](const Run& run) { return run.run == name; });
    if (old == runs.end()) throw InputError(fmt::format("there is no run {} to redo", name));
    PlannedRun again{.session = here_.run.empty() ? old->session : here_.session,
                     .kind = old->kind,
                     .location = old->location,
                     .repeat = old->repeat,
                     .duration_s = options_.duration_s};
    if (const auto raw = raw_run(logging_.file(), name); raw && raw->state == RunState::kComplete)
      again.duration_s =
          static_cast<double>(raw->frames + lost_in(raw->id)) / logging_.info().daq.sample_rate_hz;
    if (!grid_point(old->location)) {
      again.y_norm = old->y_norm;
      again.z_norm = old->z_norm;
    }
    for (const PlannedRun& planned : plan_)
      if (key_of(planned) == key_of(*old)) again.own = planned.own;
    record(again, &order);
    if (!complete_ || !old->excluded.empty()) return;
    try {
      exclude_run(logging_.file(), name, fmt::format("redone as {}", here_.run));
    } catch (const StorageError& error) {
      if (error.disk_full()) throw;
      found_problem(
          fmt::format("run {} was redone as {} and is not excluded: {}", name, here_.run, error.what()));
    }
    left_ = runs_left(logging_.file(), plan_);
    page_.book().look();
  }

  std::uint64_t lost_in(std::int64_t raw_run) {
    const auto ledger = ledger_of(logging_.file(), raw_run);
    return ledger ? ledger->frames_lost : 0;
  }

  void apply_metadata() {
    const auto metadata = page_.desk().metadata();
    for (const auto& [column, option, value] : kConditionOptions) {
      if (const auto said = metadata.find(column); said != metadata.end())
        logging_.options().*value = said->second;
    }
  }

  void begin(const PlannedRun& planned, const RunCells& cells) {
    const auto number = [&](const char* column) -> std::optional<double> {
      for (const auto& [name, text] : cells)
        if (name == column) return parse_number(text);
      return {};
    };
    here_ = {.run = cells.at(0).second,
             .location = planned.location,
             .session = planned.session,
             .repeat = planned.repeat,
             .kind = planned.kind,
             .duration_s = planned.duration_s,
             .speed_rpm = number("speed_rpm"),
             .air_temperature_C = number("air_temperature_C")};
    // What was asked for until here was another run's. Ctrl-C stays, whenever it comes.
    stop_requested = false;
    if (quit_requested) stop_requested = true;
    page_.feed().begin(here_);
  }

  /// Throws InputError where the run cannot begin; the order's answer is then its caller's to give.
  void record(const PlannedRun& planned, live::Order* order) {
    apply_metadata();
    bool begun = false;
    complete_ = false;
    const LogWatch watch{
        .frames = &page_.feed().watcher(),
        .begun = [&](const RunCells& cells) { begin(planned, cells); },
        .progress =
            [&](const LogProgress& progress) {
              page_.feed().progress(progress);
              if (progress.waiting || std::exchange(begun, true)) return;
              page_.book().look();  // its row is in the file now
              if (order != nullptr)
                order->answer({.problem = "", .text = fmt::format("{} is being recorded", here_.run)});
            },
        .ended =
            [&](const LogOutcome& outcome) {
              complete_ = outcome.state == RunState::kComplete;
              return page_.feed().end(outcome);
            }};
    placed_.reset();
    code_ = std::max(code_, logging_.record(planned, "", watch));
    left_ = runs_left(logging_.file(), plan_);
  }

  LogOptions options_;
  std::vector<PlannedRun> plan_, left_;
  Logging logging_;
  live::LiveSession page_;
  LiveRun here_;           // the last run, or where the first will be
  bool complete_ = false;  // the last run is
  std::optional<std::pair<Phase, std::string>> placed_;
  int code_ = kWell;
};

}  // namespace

int run_live(const LogOptions& options) {
  if (!options.location.empty() && !options.plan.empty())
    throw InputError("--location and --plan: one of them, or neither and let the page start runs");
  return LiveLogging(options).run();
}

}  // namespace tunnelrig::cli
