#include "analysis/run_summary.h"
#include "calibration/certificate.h"
#include "cli/console.h"
#include "cli/verb.h"
#include "cli/virtual_session.h"
#include "daq/logger.h"
#include "daq/run_plan.h"
#include "datasets/error.h"
#include "datasets/locations.h"

#include <atomic>
#include <chrono>
#include <csignal>
#include <iostream>
#include <memory>
#include <optional>

#include <fmt/format.h>

namespace tunnelrig::cli {
namespace {

struct LogOptions {
  std::string db, location, session, kind = "thrust", source = "virtual", plan, campaign, capture, pace = "1",
                                     faults;
  int repeat = 1;
  double duration_s = 60;
  std::uint64_t seed = 1;
  std::optional<double> speed_rpm, temperature_C, pressure_Pa, humidity, supply_V, motor_s;
  bool yes = false;
};

std::atomic<bool> stop_requested{false};

void stop_on_signal(int /*signal*/) { stop_requested = true; }

/// Text of a number as it goes into a cell.
std::string cell(double value) { return fmt::format("{}", value); }

double now_s() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

/// The recorder's side of the verb: a campaign file, a source, and one run after the other.
class Logging {
 public:
  explicit Logging(const LogOptions& options)
      : options_(options), file_(options.db, CampaignFile::Access::kRecord) {
    if (file_.empty()) {
      const std::string toml =
          options.campaign.empty() ? reference_campaign_toml() : read_text(options.campaign);
      parse_campaign_toml(toml, options.campaign.empty() ? "campaign.toml" : options.campaign);
      file_.set_text("campaign.toml", toml);
      if (options.campaign.empty())
        warn("a new file, so the rig is taken to be the thesis's; --campaign FILE.toml says otherwise");
    } else if (!options.campaign.empty()) {
      throw InputError::in(options.db, "holds a campaign already, so --campaign cannot apply");
    }
    info_ = file_.info();
    for (const std::string& run : close_interrupted_runs(file_))
      warn(fmt::format("run {} was interrupted; it is kept as partial", run));
    if (const auto document = file_.newest_document("calibration"))
      certificate_ = certificate_from_json(document->json);
    if (is_virtual())
      virtual_.emplace(file_, info_, options.seed);
    else
      source_ = open_source(options.source);
  }

  bool is_virtual() const { return options_.source == "virtual"; }
  const CampaignFile& file() const { return file_; }

  /// Records one run; the exit code.
  int record(const PlannedRun& planned, const std::string& note) {
    const std::string name =
        fmt::format("R{:04}", (file_.sheet("runs") ? file_.sheet("runs")->rows.size() : 0) + 1);
    double start_s = now_s();
    std::unique_ptr<PacketSource> board;
    RunCells cells = {{"run", name},
                      {"location", planned.location},
                      {"repeat", fmt::format("{}", planned.repeat)},
                      {"session", planned.session}};
    if (virtual_) {
      const VirtualRunRequest request =
          virtual_->request(planned, options_.speed_rpm.value_or(info_.rig.nominal_speed_rpm));
      start_s = request.start_s;
      board = virtual_->board(request, pace(), parse_faults(options_.faults));
      add_conditions(virtual_->readings(request), planned.kind);
    } else {
      add_conditions({}, planned.kind);
    }
    cells.emplace_back("start_utc", format_utc(start_s));
    cells.emplace_back("raw", fmt::format("raw/{}.npy", name));
    if (planned.kind == RunKind::kTare) cells.emplace_back("kind", "tare");
    if (planned.y_norm)
      cells.insert(cells.end(), {{"y_norm", cell(*planned.y_norm)}, {"z_norm", cell(*planned.z_norm)}});
    cells.insert(cells.end(), conditions_.begin(), conditions_.end());
    cells.emplace_back("source", options_.source);

    const LogSettings settings{.duration_s = planned.duration_s, .capture = options_.capture};
    const auto summarizer = [](const CampaignInfo& info, const RawFormat& format) {
      return make_run_summarizer(info, format);
    };
    LogOutcome outcome;
    {
      ProgressBar bar(note.empty() ? name : note);
      outcome = log_run(
          board ? *board : *source_, file_, cells, settings, summarizer,
          [&](const LogProgress& progress) { show(bar, progress); }, stop_requested);
    }
    return report(name, planned, outcome);
  }

 private:
  double pace() const {
    if (options_.pace == "max") return 0;
    const auto value = parse_number(options_.pace);
    if (!value || *value <= 0)
      throw InputError(fmt::format("--speed '{}': write max, or how many times real time", options_.pace));
    return *value;
  }

  /// What the instruments beside the board say: the options', else what the virtual rig's show.
  void add_conditions(const std::optional<InstrumentReadings>& shown, RunKind kind) {
    conditions_.clear();
    const auto add = [&](const char* column, std::optional<double> given, std::optional<double> read,
                         int digits) {
      if (given)
        conditions_.emplace_back(column, cell(*given));
      else if (read)
        conditions_.emplace_back(column, fmt::format("{:.{}f}", *read, digits));
    };
    const auto of = [&](double InstrumentReadings::*value) {
      return shown ? std::optional<double>((*shown).*value) : std::nullopt;
    };
    if (kind == RunKind::kThrust) {
      add("speed_rpm", options_.speed_rpm && !shown ? options_.speed_rpm : std::nullopt,
          of(&InstrumentReadings::speed_rpm), 1);
      add("time_since_motor_start_s", options_.motor_s, shown ? std::optional<double>(60) : std::nullopt, 0);
    }
    add("air_temperature_C", options_.temperature_C, of(&InstrumentReadings::air_temperature_C), 2);
    add("air_pressure_Pa", options_.pressure_Pa, of(&InstrumentReadings::air_pressure_Pa), 0);
    add("relative_humidity", options_.humidity, of(&InstrumentReadings::relative_humidity), 3);
    add("supply_voltage_V", options_.supply_V, of(&InstrumentReadings::supply_voltage_V), 3);
  }

  /// Mean thrusts so far, or volts before there is a calibration.
  std::string means_text(const std::array<double, 4>& volts) const {
    std::string text;
    for (int rotor = 0; rotor < info_.rig.rotors; ++rotor) {
      const auto i = static_cast<std::size_t>(rotor);
      text += certificate_ ? fmt::format("{:.3f} ", certificate_->force(rotor + 1, volts[i]).force_N /
                                                        certificate_->propellers.factor(rotor))
                           : fmt::format("{:.4f} ", volts[i]);
    }
    return text + (certificate_ ? "N" : "V");
  }

  void show(ProgressBar& bar, const LogProgress& progress) const {
    std::array<double, 4> volts{};
    for (std::size_t c = 0; c < volts.size(); ++c)
      volts[c] = progress.mean_counts[c] * info_.daq.volts_per_count();
    bar.show(progress.elapsed_s, progress.duration_s,
             fmt::format("{} frames, {} lost, {}{}", progress.ledger->frames_stored,
                         progress.ledger->frames_lost, means_text(volts), progress.silent ? ", SILENT" : ""));
  }

  int report(const std::string& name, const PlannedRun& planned, const LogOutcome& outcome) const {
    const Ledger& ledger = outcome.ledger;
    std::string means = "no frames";
    if (!outcome.statistics.channels.empty()) {
      std::array<double, 4> volts{};
      for (std::size_t c = 0; c < volts.size(); ++c) volts[c] = outcome.statistics.channels[c].mean_V;
      means = means_text(volts);
    }
    fmt::print("{}  {} {} #{}  {}: {} frames, {} lost, {}\n", name, planned.session, planned.location,
               planned.repeat, planned.kind == RunKind::kTare ? "tare" : "thrust", ledger.frames_stored,
               ledger.frames_lost, means);
    if (outcome.clock && !virtual_) {
      fmt::print(
          "      board clock: {:.5f} ± {:.5f} frames/s by this computer's clock over {}, drift {:+.2f} ± "
          "{:.2f} ppm/h\n",
          outcome.clock->rate_hz, outcome.clock->rate_interval_hz, duration_text(outcome.clock->span_s),
          outcome.clock->drift_ppm_h, outcome.clock->drift_interval_ppm_h);
    }
    std::fflush(stdout);
    bool problem = outcome.state != RunState::kComplete;
    if (problem) warn(fmt::format("run {} is partial: {}", name, ledger.end_reason));
    if (ledger.frames_lost > 0) {
      warn(
          fmt::format("run {}: {} of {} frames lost ({} late, {} corrupt packets, {} reboots, {} silences); "
                      "the ledger has where",
                      name, ledger.frames_lost, ledger.frames_emitted, ledger.frames_late,
                      ledger.packets_corrupt, ledger.reboots, ledger.silences));
      problem = true;
    }
    if (ledger.board_rate_hz && std::abs(*ledger.board_rate_hz / info_.daq.sample_rate_hz - 1) > 1e-3) {
      warn(fmt::format("run {}: the board samples at {:.3f} Hz, campaign.toml says {:.3f} Hz", name,
                       *ledger.board_rate_hz, info_.daq.sample_rate_hz));
      problem = true;
    }
    for (std::size_t c = 0;
         c < outcome.statistics.channels.size() && c < static_cast<std::size_t>(info_.rig.rotors); ++c) {
      const ChannelStatistics& channel = outcome.statistics.channels[c];
      if (channel.clipped > 0)
        warn(fmt::format("run {}: channel {} clipped in {} samples", name, c + 1, channel.clipped));
      if (channel.stuck())
        warn(fmt::format("run {}: channel {} is stuck at {:.4f} V", name, c + 1, channel.lowest_V));
      problem |= channel.stuck() || channel.clipped > 0;
    }
    return problem ? kProblemFound : kWell;
  }

  const LogOptions& options_;
  CampaignFile file_;
  CampaignInfo info_;
  std::optional<Certificate> certificate_;
  std::optional<VirtualSession> virtual_;
  std::unique_ptr<PacketSource> source_;
  RunCells conditions_;
};

/// What the file holds of a planned run.
bool is_done(const CampaignFile& file, const PlannedRun& planned) {
  for (const Run& run : file.runs()) {
    if (run.session != planned.session || run.kind != planned.kind || run.location != planned.location ||
        run.repeat != planned.repeat)
      continue;
    const auto raw = raw_run(file, run.run);
    if (raw && raw->state == RunState::kComplete) return true;
  }
  return false;
}

/// Asks the operator to bring the rig to the next run. False: stop here.
bool ask_operator(const PlannedRun& planned, const PlannedRun* previous) {
  const bool moved = previous == nullptr || previous->location != planned.location ||
                     previous->kind != planned.kind || previous->session != planned.session;
  if (!moved) return true;
  fmt::print("\nsession {}: {} {}; Enter when ready, q to stop here: ", planned.session,
             planned.kind == RunKind::kTare ? "motors stopped (tare) at" : "move the rig to",
             planned.location);
  std::fflush(stdout);
  std::string answer;
  return std::getline(std::cin, answer) && answer != "q";
}

int run_plan(const LogOptions& options) {
  const std::vector<PlannedRun> plan = parse_plan(read_csv(options.plan));
  Logging logging(options);
  std::vector<PlannedRun> left;
  for (const PlannedRun& planned : plan) {
    if (!is_done(logging.file(), planned)) left.push_back(planned);
  }
  fmt::print("{}: {} of {} runs to record\n", options.plan, left.size(), plan.size());
  const bool ask = !options.yes && !logging.is_virtual() && input_is_terminal();
  int code = kWell;
  for (std::size_t i = 0; i < left.size() && !stop_requested; ++i) {
    if (ask && !ask_operator(left[i], i > 0 ? &left[i - 1] : nullptr)) break;
    const std::string note = fmt::format("{}/{}", plan.size() - left.size() + i + 1, plan.size());
    code = std::max(code, logging.record(left[i], note));
  }
  return code;
}

int run_one(const LogOptions& options) {
  if (options.location.empty() || options.session.empty())
    throw InputError("log: --location and --session are required (or --plan FILE)");
  Logging logging(options);
  return logging.record({.session = options.session,
                         .kind = options.kind == "tare" ? RunKind::kTare : RunKind::kThrust,
                         .location = options.location,
                         .repeat = options.repeat,
                         .duration_s = options.duration_s},
                        "");
}

int run_log(const LogOptions& options) {
  if (!(options.duration_s > 0)) throw InputError("--duration: seconds, above 0");
  std::signal(SIGINT, stop_on_signal);
  std::signal(SIGTERM, stop_on_signal);
  try {
    return options.plan.empty() ? run_one(options) : run_plan(options);
  } catch (const StorageError& error) {
    if (!error.disk_full()) throw;
    throw StorageError(fmt::format("the disk is full ({}). The run ends here as partial; everything before "
                                   "it is safe. Make room and log again.",
                                   error.what()),
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
  verb->add_option("--duration", options->duration_s, "Seconds")->capture_default_str();
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
  verb->add_option("--capture", options->capture,
                   "Write the received bytes to this file too (for --source replay:FILE)");
  verb->add_option("--speed", options->pace, "Virtual rig: times real time, or max")->capture_default_str();
  verb->add_option("--seed", options->seed, "Virtual rig: of everything it does")->capture_default_str();
  verb->add_option(
      "--faults", options->faults,
      "Virtual rig: "
      "drop=0.001,duplicate=…,reorder=…,corrupt=…,truncate=…,garbage=…,stall=AT:FOR,reboot=AT:FOR");
  verb->callback([options, &work] { work = [options] { return run_log(*options); }; });
}

}  // namespace tunnelrig::cli
