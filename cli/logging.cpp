#include "cli/logging.h"

#include "analysis/campaign_data.h"
#include "analysis/run_summary.h"
#include "cli/console.h"
#include "cli/live/book.h"
#include "cli/live/run_alarms.h"
#include "datasets/error.h"
#include "datasets/locations.h"
#include "datasets/open_space.h"
#include "datasets/recorded_rate.h"
#include "datasets/run_marks.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <set>

#include <fmt/format.h>

namespace tunnelrig::cli {

std::atomic<bool> stop_requested{false}, quit_requested{false};

namespace {

/// Text of a number as it goes into a cell.
std::string cell(double value) { return fmt::format("{}", value); }

double now_s() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

/// Of the next run: an import brings names and raw files of its own, which may be R0002 and raw/R0002.npy.
std::string free_name(const CampaignFile& file) {
  const Sheet runs = file.sheet("runs").value_or(Sheet());
  std::set<std::string> taken;
  for (std::size_t row = 0; row < runs.rows.size(); ++row) {
    const std::filesystem::path raw(runs.text(row, "raw"));
    taken.insert({runs.text(row, "run"), raw.lexically_normal().replace_extension().string()});
  }
  for (std::size_t number = runs.rows.size() + 1;; ++number) {
    std::string name = fmt::format("R{:04}", number);
    if (!taken.contains(name) && !taken.contains("raw/" + name)) return name;
  }
}

/// Says what arrived and could not be used. True where it is a problem: what came twice is not.
bool warn_of_unusable(const std::string& run, const Ledger& ledger) {
  if (ledger.frames_stored == 0 && ledger.bytes_skipped > 0)
    warn(fmt::format("run {}: {} bytes arrived that are no packets of version 1 (docs/wire-format.md)", run,
                     ledger.bytes_skipped));
  if (ledger.packets_corrupt > 0)
    warn(
        fmt::format("run {}: {} refused: a wrong checksum, a number that is not believed, or "
                    "other frames under numbers that had passed",
                    run,
                    ledger.packets_corrupt == 1 ? "1 packet was"
                                                : fmt::format("{} packets were", ledger.packets_corrupt)));
  if (much_came_again(ledger))
    warn(
        fmt::format("run {}: {} frames came under numbers that had passed and were dropped; a board that "
                    "restarts needs a new boot id",
                    run, ledger.frames_duplicate));
  return ledger.packets_corrupt > 0;
}

/// Says where the board's rate is not the campaign's. True where it is a problem.
bool warn_of_rate(const std::string& run, const Ledger& ledger, double campaign_rate_hz) {
  if (ledger.frames_stored > 0 && !ledger.board_rate_hz) {
    warn(fmt::format(
        "run {}: the board says no rate (0 ticks a second, or a frame); {:.3f} Hz, campaign.toml's, "
        "is taken for it",
        run, campaign_rate_hz));
    return true;
  }
  if (!is_another_rate(ledger.board_rate_hz, campaign_rate_hz)) return false;
  warn(fmt::format(
      "run {}: the board samples at {:.3f} Hz, campaign.toml says {:.3f} Hz; by the board the run is "
      "{:.3f} s long, but its spectrum and times go by campaign.toml",
      run, *ledger.board_rate_hz, campaign_rate_hz,
      static_cast<double>(ledger.frames_emitted) / *ledger.board_rate_hz));
  return true;
}

/// What was received once does not come again: it is never written over, not even by the rest of its plan.
void check_capture(const std::string& capture) {
  std::error_code error;
  if (capture.empty() || !std::filesystem::is_regular_file(capture, error)) return;
  if (std::filesystem::file_size(capture, error) == 0) return;
  throw InputError(fmt::format(
      "--capture {}: exists and is not empty; what was captured is not written over, name another file",
      capture));
}

/// What no run sheet could hold would make every run of the file unreadable: it is refused before there is
/// one.
const LogOptions& checked(const LogOptions& options) {
  for (const auto& [option, text] : {std::pair("--session", &options.session),
                                     {"--location", &options.location},
                                     {"--source", &options.source}})
    if (!is_utf8(*text)) throw InputError(fmt::format("{}: this is not UTF-8 text", option));
  std::error_code error;
  if (const std::string_view replay = "replay:";
      options.source.starts_with(replay) &&
      std::filesystem::equivalent(options.source.substr(replay.size()), options.capture, error))
    throw InputError(fmt::format("--capture {}: this is what --source replays", options.capture));
  check_capture(options.capture);
  if (options.repeat < 0) throw InputError(fmt::format("--repeat: {} is below 0", options.repeat));
  for (const auto& [column, option, value] : kConditionOptions)
    if (const auto given = options.*value)
      if (const std::string why = outside_range(column, *given); !why.empty())
        throw InputError(fmt::format("{}: {}", option, why));
  return options;
}

}  // namespace

Logging::Leftover::~Leftover() {
  if (!file.made() || std::uncaught_exceptions() == errors) return;
  try {
    if (!raw_runs(file).empty()) return;
  } catch (const StorageError&) {
    return;
  }
  std::error_code error;  // the lock's own file goes with the lock
  for (const auto& each : files_of_campaign(file.path())) std::filesystem::remove(each, error);
}

Logging::Logging(const LogOptions& options)
    : options_(checked(options)), file_(options.db, CampaignFile::Access::kRecord) {
  if (file_.empty()) {
    const std::string toml =
        options.campaign.empty() ? reference_campaign_toml() : read_text(options.campaign);
    const CampaignInfo info =
        parse_campaign_toml(toml, options.campaign.empty() ? "campaign.toml" : options.campaign);
    for (const std::string& unread : info.unread) warn(unread);
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
  if (options_.source == "virtual")
    virtual_.emplace(file_, info_, options.seed);
  else
    source_ = open_source(options.source);
}

int Logging::record(const PlannedRun& planned, const std::string& note, const LogWatch& watch) {
  doubt_place(planned);
  const std::string name = free_name(file_);
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
  if (planned.y_norm && planned.z_norm)
    cells.insert(cells.end(), {{"y_norm", cell(*planned.y_norm)}, {"z_norm", cell(*planned.z_norm)}});
  cells.insert(cells.end(), conditions_.begin(), conditions_.end());
  cells.insert(cells.end(), planned.own.begin(), planned.own.end());
  cells.emplace_back("source", options_.source);

  if (!options_.capture.empty() && !capture_.is_open()) capture_ = open_to_write(options_.capture);
  const LogSettings settings{.duration_s = planned.duration_s,
                             .capture = capture_.is_open() ? &capture_ : nullptr,
                             .watcher = watch.frames};
  const auto measured = std::ranges::find(conditions_, "speed_rpm", &RunCells::value_type::first);
  const auto summarizer = [&](const CampaignInfo& info, const RawFormat& format) {
    return make_run_summarizer(
        measured == conditions_.end() ? info : at_speed(info, parse_number(measured->second)), format);
  };
  LogOutcome outcome;
  {
    ProgressBar bar(note.empty() ? name : note);
    if (watch.begun) watch.begun(cells);
    outcome = log_run(
        board ? *board : *source_, file_, cells, settings, summarizer,
        [&](const LogProgress& progress) {
          show(bar, progress);
          if (watch.progress) watch.progress(progress);
        },
        stop_requested);
  }
  if (watch.ended)
    watch.ended(name, outcome);
  else
    mark_alarms(file_, name, alarms(planned, outcome));
  const int code = report(name, planned, outcome);
  if (capture_) return code;
  warn(fmt::format("{}: cannot be written any more, is the disk full? The recording is in {} all the same",
                   options_.capture, options_.db));
  return kProblemFound;
}

/// A label that is a slip of the pen: the run would be on no map.
void Logging::doubt_place(const PlannedRun& planned) {
  if (!info_.tunnel || planned.kind == RunKind::kTare || planned.y_norm || grid_point(planned.location))
    return;
  Run run;
  run.location = planned.location;
  for (const auto& [column, text] : planned.own)
    if (const auto value = parse_number(text)) run.numbers.emplace(column, *value);
  if (in_open_space(run) || !nowhere_.insert(planned.location).second) return;
  warn(fmt::format(
      "location '{}' is none of the tunnel's grid (H0 to H5, V-3 to V3) nor of open space (OS, GND…, CEIL…), "
      "and has no y_norm and z_norm: its runs count as in no tunnel",
      planned.location));
}

/// What a page would have marked the run with, as far as its frames tell.
std::string Logging::alarms(const PlannedRun& planned, const LogOutcome& outcome) {
  // Newtons need the tares, which only a tare changes: the whole file is not read after every run.
  if (certificate_ && (!cells_ || planned.kind == RunKind::kTare))
    cells_ = live::cells_of(read_campaign_data(file_));
  const live::Scale scale = live::scale_of(cells_.value_or(live::CellKnowledge()), info_, planned.session);
  return live::alarms_of(outcome, scale, info_, "");
}

double Logging::pace() const {
  if (options_.pace == "max") return 0;
  const auto value = parse_number(options_.pace);
  if (!value || *value <= 0)
    throw InputError(fmt::format("--speed '{}': write max, or how many times real time", options_.pace));
  return *value;
}

/// What the instruments beside the board say: the options', else what the virtual rig's show.
void Logging::add_conditions(const std::optional<InstrumentReadings>& shown, RunKind kind) {
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
std::string Logging::means_text(const std::array<double, 4>& volts) const {
  std::string text;
  for (int rotor = 0; rotor < info_.rig.rotors; ++rotor) {
    const auto i = static_cast<std::size_t>(rotor);
    text += certificate_ ? fmt::format("{:.3f} ", certificate_->force(rotor + 1, volts[i]).force_N /
                                                      certificate_->propellers.factor(rotor))
                         : fmt::format("{:.4f} ", volts[i]);
  }
  return text + (certificate_ ? "N" : "V");
}

void Logging::show(ProgressBar& bar, const LogProgress& progress) const {
  std::array<double, 4> volts{};
  for (std::size_t c = 0; c < volts.size(); ++c)
    volts[c] = progress.mean_counts[c] * info_.daq.volts_per_count();
  bar.show(progress.elapsed_s, progress.duration_s,
           fmt::format("{} frames, {} lost, {}{}", progress.ledger->frames_stored,
                       progress.ledger->frames_lost, means_text(volts),
                       progress.held_up           ? ", ANOTHER PROGRAM HOLDS THE FILE"
                       : !progress.silent         ? ""
                       : progress.instead.empty() ? ", SILENT"
                                                  : fmt::format(", ONLY {}", progress.instead)));
}

int Logging::report(const std::string& name, const PlannedRun& planned, const LogOutcome& outcome) const {
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
  problem |= warn_of_unusable(name, ledger);
  if (ledger.frames_test_pattern > 0) {
    warn(fmt::format("run {}: {} frames are the board's test pattern, no measurements", name,
                     ledger.frames_test_pattern));
    problem = true;
  }
  for (const auto& [frames, what] :
       {std::pair(ledger.frames_adc_error, "errors of the converter"), {ledger.frames_clipped, "clipped"}}) {
    if (frames == 0) continue;
    warn(fmt::format("run {}: the board flags {} frames as {}", name, frames, what));
    problem = true;
  }
  problem |= warn_of_rate(name, ledger, info_.daq.sample_rate_hz);
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

std::vector<PlannedRun> read_plan(const std::string& path) {
  const Sheet sheet = read_csv(path);
  std::vector<PlannedRun> plan = parse_plan(sheet);
  for (const std::string& doubt : plan_doubts(sheet)) warn(doubt);
  return plan;
}

std::vector<PlannedRun> runs_left(const CampaignFile& file, const std::vector<PlannedRun>& plan) {
  std::set<std::string> complete;
  for (const RawRun& raw : raw_runs(file)) {
    if (raw.state == RunState::kComplete) complete.insert(raw.run);
  }
  std::set<RunKey> done;
  for (const Run& run : file.runs()) {
    if (run.excluded.empty() && complete.contains(run.run)) done.insert(key_of(run));
  }
  std::vector<PlannedRun> left;
  for (const PlannedRun& planned : plan) {
    if (!done.contains(key_of(planned))) left.push_back(planned);
  }
  return left;
}

}  // namespace tunnelrig::cli
