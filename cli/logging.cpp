#include "cli/logging.h"

#include "analysis/campaign_data.h"
#include "analysis/run_summary.h"
#include "cli/console.h"
#include "cli/live/book.h"
#include "cli/live/run_alarms.h"
#include "cli/run_warnings.h"
#include "datasets/error.h"
#include "datasets/locations.h"
#include "datasets/open_space.h"
#include "datasets/run_marks.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <set>
#include <thread>
#include <utility>

#include <fmt/format.h>

namespace tunnelrig::cli {

std::atomic<bool> stop_requested{false}, quit_requested{false};

namespace {

constexpr int kMarkPause_ms = 20;

/// Text of a number as it goes into a cell.
std::string cell(double value) { return fmt::format("{}", value); }

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
  double start_s = utc_seconds();
  std::unique_ptr<PacketSource> board;  // the virtual rig's
  if (virtual_) {
    const VirtualRunRequest request =
        virtual_->request(planned, options_.speed_rpm.value_or(info_.rig.nominal_speed_rpm));
    start_s = request.start_s;
    board = virtual_->board(request, pace(), parse_faults(options_.faults));
    add_conditions(virtual_->readings(request), planned.kind);
  } else {
    add_conditions({}, planned.kind);
  }
  if (!options_.capture.empty() && !capture_.is_open()) capture_ = open_to_write(options_.capture);
  const LogOutcome outcome = log(board ? *board : *source_, row(name, planned, start_s), planned.duration_s,
                                 note.empty() ? name : note, watch);
  mark(name, watch.ended ? watch.ended(outcome) : alarms(planned, outcome));
  print(name, planned, outcome);
  const int code = warn_of_run(name, outcome, info_) ? kProblemFound : kWell;
  if (capture_) return code;
  warn(fmt::format("{}: cannot be written any more, is the disk full? The recording is in {} all the same",
                   options_.capture, options_.db));
  return kProblemFound;
}

/// The run as runs.csv has it.
RunCells Logging::row(const std::string& name, const PlannedRun& planned, double start_s) const {
  RunCells cells = {{"run", name},
                    {"location", planned.location},
                    {"repeat", fmt::format("{}", planned.repeat)},
                    {"session", planned.session},
                    {"start_utc", format_utc(start_s)},
                    {"raw", fmt::format("raw/{}.npy", name)}};
  if (planned.kind == RunKind::kTare) cells.emplace_back("kind", "tare");
  if (planned.y_norm && planned.z_norm)
    cells.insert(cells.end(), {{"y_norm", cell(*planned.y_norm)}, {"z_norm", cell(*planned.z_norm)}});
  cells.insert(cells.end(), conditions_.begin(), conditions_.end());
  cells.insert(cells.end(), planned.own.begin(), planned.own.end());
  cells.emplace_back("source", options_.source);
  return cells;
}

LogOutcome Logging::log(PacketSource& source, const RunCells& cells, double duration_s,
                        const std::string& note, const LogWatch& watch) {
  const LogSettings settings{
      .duration_s = duration_s, .capture = capture_.is_open() ? &capture_ : nullptr, .watcher = watch.frames};
  const auto measured = std::ranges::find(conditions_, "speed_rpm", &RunCells::value_type::first);
  const auto summarizer = [&](const CampaignInfo& info, const RawFormat& format) {
    return make_run_summarizer(
        measured == conditions_.end() ? info : at_speed(info, parse_number(measured->second)), format);
  };
  ProgressBar bar(note);
  if (watch.begun) watch.begun(cells);
  return log_run(
      source, file_, cells, settings, summarizer,
      [&](const LogProgress& progress) {
        show(bar, progress);
        if (watch.progress) watch.progress(progress);
      },
      stop_requested);
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

/// A run that is in the file is worth more than its marks: whoever asks to stop does not wait for them.
void Logging::mark(const std::string& name, const std::string& alarms) {
  bool told = false;
  while (!mark_alarms(file_, name, alarms)) {
    if (quit_requested) {
      warn(fmt::format("run {} is not marked with its alarms ({}): another program is writing to {}", name,
                       alarms.empty() ? "none" : alarms, options_.db));
      return;
    }
    if (!std::exchange(told, true))
      warn(fmt::format("another program is writing to {}; run {} is marked with its alarms once it has ended",
                       options_.db, name));
    idle();
    std::this_thread::sleep_for(std::chrono::milliseconds(kMarkPause_ms));
  }
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
                       progress.held_up            ? ", ANOTHER PROGRAM HOLDS THE FILE"
                       : !progress.silent          ? ""
                       : !progress.problem.empty() ? fmt::format(", SILENT: {}", progress.problem)
                       : progress.instead.empty()  ? ", SILENT"
                                                   : fmt::format(", ONLY {}", progress.instead)));
}

void Logging::print(const std::string& name, const PlannedRun& planned, const LogOutcome& outcome) const {
  std::string means = "no frames";
  if (!outcome.statistics.channels.empty()) {
    std::array<double, 4> volts{};
    for (std::size_t c = 0; c < volts.size(); ++c) volts[c] = outcome.statistics.channels[c].mean_V;
    means = means_text(volts);
  }
  fmt::print("{}  {} {} #{}  {}: {} frames, {} lost, {}\n", name, planned.session, planned.location,
             planned.repeat, planned.kind == RunKind::kTare ? "tare" : "thrust", outcome.ledger.frames_stored,
             outcome.ledger.frames_lost, means);
  if (outcome.clock && !virtual_) {
    fmt::print(
        "      board clock: {:.5f} ± {:.5f} frames/s by this computer's clock over {}, drift {:+.2f} ± "
        "{:.2f} ppm/h\n",
        outcome.clock->rate_hz, outcome.clock->rate_interval_hz, duration_text(outcome.clock->span_s),
        outcome.clock->drift_ppm_h, outcome.clock->drift_interval_ppm_h);
  }
  std::fflush(stdout);
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
