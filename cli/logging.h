// A campaign file, a source, and one run after the other: what `log` does with a page and without.
#pragma once

#include "calibration/certificate.h"
#include "cli/live/scale.h"
#include "cli/virtual_session.h"
#include "daq/logger.h"
#include "daq/run_plan.h"

#include <array>
#include <atomic>
#include <cstdint>
#include <exception>
#include <fstream>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace tunnelrig::cli {

class ProgressBar;

struct LogOptions {
  std::string db, location, session, kind = "thrust", source = "virtual", plan, campaign, capture, pace = "1",
                                     faults;
  int repeat = 1;
  double duration_s = 60;
  std::uint64_t seed = 1;
  std::optional<double> speed_rpm, temperature_C, pressure_Pa, humidity, supply_V, motor_s;
  bool yes = false;

  std::optional<int> live_port;  // --live
  std::string listen;            // --listen, with --live
};

/// What the instruments beside the board read, by the column that it is stored in.
struct ConditionOption {
  const char *column, *option;
  std::optional<double> LogOptions::*value;
};
inline constexpr std::array<ConditionOption, 6> kConditionOptions = {
    {{"speed_rpm", "--speed-rpm", &LogOptions::speed_rpm},
     {"air_temperature_C", "--temperature-C", &LogOptions::temperature_C},
     {"air_pressure_Pa", "--pressure-Pa", &LogOptions::pressure_Pa},
     {"relative_humidity", "--humidity", &LogOptions::humidity},
     {"supply_voltage_V", "--supply-V", &LogOptions::supply_V},
     {"time_since_motor_start_s", "--motor-s", &LogOptions::motor_s}}};

/// The run under way is to end; the whole program is. Set by Ctrl-C (both) and by the live page (the first).
extern std::atomic<bool> stop_requested, quit_requested;

/// What is told of a run to whoever watches it.
struct LogWatch {
  FrameSink* frames = nullptr;                       // as LogSettings::watcher
  std::function<void(const RunCells&)> begun;        // before its first frame
  std::function<void(const LogProgress&)> progress;  // several times a second
  /// Before the next can begin; the alarms that the run had.
  std::function<std::string(const LogOutcome&)> ended;
};

/// The recorder's side of the verb.
class Logging {
 public:
  /// Opens or makes the campaign file. Throws InputError where it is recorded to already, and where the
  /// source cannot be had.
  explicit Logging(const LogOptions& options);

  bool is_virtual() const { return virtual_.has_value(); }
  CampaignFile& file() { return file_; }
  const CampaignInfo& info() const { return info_; }

  /// Records one run; the exit code. `note` stands beside the progress bar.
  int record(const PlannedRun& planned, const std::string& note, const LogWatch& watch = {});

  /// To be called while a person is waited for: what the board sends meanwhile is none of the next run's.
  void idle() {
    if (source_) source_->idle();
  }

  /// What the instruments read, from the next run on, in place of the options'.
  LogOptions& options() { return options_; }

 private:
  double pace() const;
  std::string alarms(const PlannedRun& planned, const LogOutcome& outcome);
  void mark(const std::string& name, const std::string& alarms);
  void doubt_place(const PlannedRun& planned);
  void add_conditions(const std::optional<InstrumentReadings>& shown, RunKind kind);
  std::string means_text(const std::array<double, 4>& volts) const;
  void show(ProgressBar& bar, const LogProgress& progress) const;
  RunCells row(const std::string& name, const PlannedRun& planned, double start_s) const;
  LogOutcome log(PacketSource& source, const RunCells& cells, double duration_s, const std::string& note,
                 const LogWatch& watch);
  void print(const std::string& name, const PlannedRun& planned, const LogOutcome& outcome) const;

  /// Where an error ends the call, a file that it made and recorded nothing to would only be in the way. It
  /// goes while file_ still holds the lock: a moment later it may be another recorder's.
  struct Leftover {
    CampaignFile& file;
    const int errors = std::uncaught_exceptions();
    ~Leftover();
  };

  LogOptions options_;
  CampaignFile file_;
  Leftover leftover_{file_};
  CampaignInfo info_;
  std::optional<Certificate> certificate_;
  std::optional<live::CellKnowledge> cells_;  // of the alarms, once a run has ended
  std::optional<VirtualSession> virtual_;
  std::unique_ptr<PacketSource> source_;
  std::ofstream capture_;  // of all runs, from the first on
  RunCells conditions_;
  std::set<std::string> nowhere_;  // locations that were warned of
};

/// The runs of a plan that the file does not hold: complete, and not excluded.
std::vector<PlannedRun> runs_left(const CampaignFile& file, const std::vector<PlannedRun>& plan);

/// The runs of a plan file; warns of what of it is not stored. Throws InputError as parse_plan does.
std::vector<PlannedRun> read_plan(const std::string& path);

/// `log --live`: the exit code.
int run_live(const LogOptions& options);

}  // namespace tunnelrig::cli
