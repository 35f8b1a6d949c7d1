#include "cli/console.h"
#include "cli/logging.h"
#include "cli/verb.h"
#include "datasets/campaign_file.h"
#include "datasets/error.h"
#include "datasets/raw_store.h"

#include <csignal>
#include <filesystem>
#include <iostream>
#include <memory>
#include <set>
#include <string>
#include <string_view>

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

namespace tunnelrig::cli {
namespace {

constexpr int kIdle_ms = 100;

void stop_on_signal(int /*signal*/) {
  stop_requested = true;
  quit_requested = true;
}

/// False where a signal asks to stop: a read would go on waiting.
bool wait_for_input(Logging& logging) {
  pollfd input{STDIN_FILENO, POLLIN, 0};
  while (!stop_requested) {
    if (::poll(&input, 1, kIdle_ms) > 0) return true;
    logging.idle();
  }
  return false;
}

/// Asks the operator to bring the rig to the next run. False: stop here.
bool ask_operator(Logging& logging, const PlannedRun& planned, const PlannedRun* previous) {
  const bool moved = previous == nullptr || previous->location != planned.location ||
                     previous->kind != planned.kind || previous->session != planned.session;
  if (!moved) return true;
  fmt::print("\nsession {}: {} {}; Enter when ready, q to stop here: ", planned.session,
             planned.kind == RunKind::kTare ? "motors stopped (tare) at" : "move the rig to",
             planned.location);
  std::fflush(stdout);
  std::string answer;
  return wait_for_input(logging) && std::getline(std::cin, answer) && answer != "q";
}

int run_plan(const LogOptions& options) {
  const std::vector<PlannedRun> plan = read_plan(options.plan);
  Logging logging(options);
  const std::vector<PlannedRun> left = runs_left(logging.file(), plan);
  fmt::print("{}: {} of {} runs to record\n", options.plan, left.size(), plan.size());
  const bool ask = !options.yes && !logging.is_virtual() && input_is_terminal();
  int code = kWell;
  for (std::size_t i = 0; i < left.size() && !stop_requested; ++i) {
    if (ask && !ask_operator(logging, left[i], i > 0 ? &left[i - 1] : nullptr)) break;
    const std::string note = fmt::format("{}/{}", plan.size() - left.size() + i + 1, plan.size());
    code = std::max(code, logging.record(left[i], note));
  }
  return code;
}

int run_one(const LogOptions& options) {
  if (options.location.empty() || options.session.empty())
    throw InputError("log: --location and --session are required (or --plan FILE)");
  const PlannedRun asked{.session = options.session,
                         .kind = options.kind == "tare" ? RunKind::kTare : RunKind::kThrust,
                         .location = options.location,
                         .repeat = options.repeat,
                         .duration_s = options.duration_s};
  Logging logging(options);
  if (runs_left(logging.file(), {asked}).empty())
    warn(fmt::format(
        "{} holds a complete {} run of session {} at {}, repeat {}, already; both are kept, and count "
        "as two repeats (--repeat numbers them)",
        options.db, options.kind, asked.session, asked.location, asked.repeat));
  return logging.record(asked, "");
}

/// Names of the runs that the file holds; none where there is none, or it cannot be read.
std::set<std::string> runs_in(const std::string& db) {
  std::set<std::string> names;
  std::error_code error;
  if (!std::filesystem::exists(db, error)) return names;
  try {
    for (const RawRun& run : raw_runs(CampaignFile(db, CampaignFile::Access::kRead))) names.insert(run.run);
  } catch (const std::runtime_error&) {  // whoever records to it says why
    return names;
  }
  return names;
}

/// Of a recording that a full disk has ended. `before`: runs that were there before it.
std::string what_is_kept(const std::string& db, const std::set<std::string>& before) {
  std::error_code error;
  if (!std::filesystem::exists(db, error))
    return fmt::format("Nothing was recorded, and there is no {}.", db);
  try {
    const CampaignFile file(db, CampaignFile::Access::kRead);
    for (const RawRun& run : raw_runs(file))
      if (!before.contains(run.run) && run.state == RunState::kRecording && run.frames > 0)
        return "The run ends here as partial; everything before it is safe.";
    return "What was recorded until then is safe.";
  } catch (const std::runtime_error&) {  // even to read takes some room
    return "What was recorded until then is safe.";
  }
}

/// What would be left out in silence.
void refuse_unused(const LogOptions& options, const CLI::App& verb) {
  if (options.source != "virtual")
    refuse_given(verb, {"--speed", "--seed", "--faults"}, "is for the virtual rig, not for another --source");
  constexpr std::string_view kOfPlan = "is for one run; --plan says it of each of its own";
  if (!options.plan.empty()) {
    refuse_given(verb, {"--kind", "--repeat"}, kOfPlan);
    // With a page session and duration are those of runs that it adds to the plan's.
    if (!options.live_port) refuse_given(verb, {"--location", "--session", "--duration"}, kOfPlan);
  } else if (options.live_port && options.location.empty()) {
    refuse_given(verb, {"--kind", "--repeat"}, "is of the run at --location, which is not given");
  }
}

int run_log(const LogOptions& options, const CLI::App& verb) {
  refuse_unused(options, verb);
  if (!(options.duration_s > 0 && options.duration_s <= kLongestRun_s))
    throw InputError(
        fmt::format("--duration {:g}: seconds, above 0, at most {:g}", options.duration_s, kLongestRun_s));
  if (!options.listen.empty() && !options.live_port)
    throw InputError("--listen says from where the live page can be reached; it goes with --live");
  const std::set<std::string> before = runs_in(options.db);
  std::signal(SIGINT, stop_on_signal);
  std::signal(SIGTERM, stop_on_signal);
  // The terminal is closed, or the SSH connection is gone; nohup asked not to mind.
  if (std::signal(SIGHUP, stop_on_signal) == SIG_IGN) std::signal(SIGHUP, SIG_IGN);
  std::signal(SIGPIPE, SIG_IGN);  // whoever reads --capture by a pipe may end before the recording does
  try {
    if (options.live_port) return run_live(options);
    return options.plan.empty() ? run_one(options) : run_plan(options);
  } catch (const StorageError& error) {
    if (!error.disk_full()) throw;
    throw StorageError(fmt::format("the disk is full ({}). {} Make room and log again.", error.what(),
                                   what_is_kept(options.db, before)),
                       true);
  }
}

}  // namespace

void add_log(CLI::App& app, Work& work) {
  auto options = std::make_shared<LogOptions>();
  CLI::App* verb = app.add_subcommand("log", "Record runs from the board, or from the virtual rig");
  verb->footer(
      "One run, or a plan of them; a plan resumes where it stopped. Ctrl-C ends the run and keeps what was "
      "recorded.\n"
      "Without --source the virtual rig is recorded: simulated, and marked so in the column `source`.\n\n"
      "Examples: tunnelrig log --db my.db --location H4V-2 --repeat 3 --session S2 --source usb "
      "--temperature-C 21.3\n"
      "          tunnelrig log --db my.db --location H4V-2 --repeat 3 --session S2 --source "
      "serial:/dev/ttyUSB0 --temperature-C 21.3\n"
      "          tunnelrig log --db my.db --location OT --session S2 --kind tare --source "
      "tcp:rig.local:4000\n"
      "          tunnelrig log --db demo.db --plan plan.csv --speed max");
  verb->add_option("--db", options->db, "Campaign file; made where it is missing")->required();
  verb->add_option("--location", options->location, "Label of the location: H4V-2, OT, OS, GND1.25, …");
  verb->add_option("--repeat", options->repeat, "Number of the run at this location")->capture_default_str();
  verb->add_option("--session", options->session, "One set-up of the rig on one day");
  verb->add_option("--duration", options->duration_s,
                   "Seconds; a plan has its own, and with --live this is for the page's runs")
      ->capture_default_str();
  verb->add_option("--kind", options->kind, "tare: motors stopped")
      ->check(CLI::IsMember({"thrust", "tare"}))
      ->capture_default_str();
  verb->add_option("--source", options->source,
                   "virtual, usb[:SERIAL][,test-pattern][,rate=4000/3][,oversampling=8], tcp:HOST:PORT, "
                   "serial:DEVICE[@BAUD] or replay:FILE")
      ->capture_default_str();
  verb->add_option("--plan", options->plan, "CSV of runs to record, one after the other (`tunnelrig plan`)");
  verb->add_flag("--yes", options->yes, "Do not ask between locations");
  verb->add_option("--campaign", options->campaign, "campaign.toml for a new file (the thesis's rig)");
  verb->add_option("--speed-rpm", options->speed_rpm,
                   "Rotor speed by tachometer; of the virtual rig: the speed it is set to");
  verb->add_option("--temperature-C", options->temperature_C, "Air temperature");
  verb->add_option("--pressure-Pa", options->pressure_Pa, "Air pressure");
  verb->add_option("--humidity", options->humidity, "Relative humidity, 0 to 1");
  verb->add_option("--supply-V", options->supply_V, "Supply voltage");
  verb->add_option("--motor-s", options->motor_s, "Seconds since the motors started");
  verb->add_option(
      "--capture", options->capture,
      "Write the received bytes of all runs to this new file too (--source replay:FILE plays back the "
      "first)");
  verb->add_option("--speed", options->pace, "Virtual rig: times real time, or max")->capture_default_str();
  verb->add_option("--seed", options->seed, "Virtual rig: of everything it does")->capture_default_str();
  verb->add_option("--live", options->live_port,
                   "Serve a page that shows the recording and steers it, at this port (8266; 0: any that is "
                   "free); docs/live.md")
      ->expected(0, 1)
      ->check(CLI::Range(0, 65535))
      ->type_name("[PORT]");
  verb->add_option(
      "--listen", options->listen,
      "With --live: the address of this computer to listen on, where the loopback is not enough; "
      "it takes a token then");
  verb->add_option(
      "--faults", options->faults,
      "Virtual rig: "
      "drop=0.001,duplicate=…,reorder=…,corrupt=…,truncate=…,garbage=…,stall=AT:FOR,reboot=AT:FOR");
  verb->callback([options, verb, &work] { work = [options, verb] { return run_log(*options, *verb); }; });
}

}  // namespace tunnelrig::cli
