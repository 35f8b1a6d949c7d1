#include "analysis/health.h"

#include "analysis/implausible_thrust.h"
#include "analysis/reduction.h"
#include "datasets/error.h"
#include "datasets/first_few.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

namespace tunnelrig {
namespace {

constexpr std::size_t kNamedRuns = 6;      // runs that a finding names before it says how many more there are
constexpr double kMuchLost = 0.01;         // share of a run's frames
constexpr double kSpeedTolerance = 0.003;  // of the nominal speed, the thesis's ±15 rev/min
constexpr double kTachometerAgrees = 0.005;  // shaft line against tachometer
constexpr double kRateAgrees = 1e-3;         // board's clock against campaign.toml

/// Collects names and says them in a sentence's length.
class Names {
 public:
  void add(const std::string& name) { names_.push_back(name); }
  bool empty() const { return names_.empty(); }
  std::size_t size() const { return names_.size(); }
  std::string text() const { return first_few(names_, kNamedRuns); }

 private:
  std::vector<std::string> names_;
};

class Examination {
 public:
  Examination(const CampaignFile& file, const CampaignData& data) : file_(file), data_(data) {
    for (const Run& run : data.runs)
      if (!run.excluded.empty()) excluded_.insert(run.run);
  }

  std::vector<Finding> take() { return std::move(findings_); }

  void integrity() {
    const std::string problems = file_.integrity_problems();
    if (problems.empty())
      good("data base", "SQLite finds nothing wrong");
    else
      problem("data base", problems,
              "restore the file from a copy; `tunnelrig export` saves what can still be read");
  }

  void raw_data(const std::function<void(std::size_t, std::size_t)>& progress) {
    Names damaged, changed, alike;
    std::map<std::string, std::string> first;  // run of each hash
    std::size_t done = 0;
    for (const auto& [name, run] : data_.raw) {
      try {
        const std::string hash = hash_of(run);
        if (!run.hash.empty() && hash != run.hash) changed.add(name);
        if (excluded_.contains(name)) continue;
        const auto [known, fresh] = first.emplace(hash, name);
        if (!fresh && run.frames > 0) alike.add(fmt::format("{} and {}", known->second, name));
      } catch (const StorageError&) {
        damaged.add(name);
      }
      if (progress) progress(++done, data_.raw.size());
    }
    if (!damaged.empty())
      problem("raw data", "damaged blobs in " + damaged.text(),
              "restore the file from a copy, or record these runs again");
    if (!changed.empty())
      problem("raw data", "not what was recorded: " + changed.text(), "restore the file from a copy");
    if (!alike.empty())
      problem("raw data", "the same frames in " + alike.text(),
              "one recording counts twice: correct `raw` in runs.csv, or exclude one of them");
    if (damaged.empty() && changed.empty() && alike.empty())
      good("raw data", fmt::format("{} runs, every blob has its checksum", data_.raw.size()));
  }

  void states() {
    Names interrupted, partial, missing;
    for (const Run& run : data_.runs) {
      const auto raw = data_.raw.find(run.run);
      if (raw == data_.raw.end()) {
        if (!run.raw.empty()) missing.add(run.run);
      } else if (raw->second.state == RunState::kRecording) {
        interrupted.add(run.run);
      } else if (raw->second.state == RunState::kPartial) {
        partial.add(run.run);
      }
    }
    if (!interrupted.empty())
      note("recordings", "under way, or cut off by a kill: " + interrupted.text(),
           "the next `tunnelrig log` marks what was cut off as partial");
    if (!partial.empty())
      note("recordings", "partial, left out of the reduction: " + partial.text(),
           "record them again (`tunnelrig log --plan` does)");
    if (!missing.empty())
      problem("recordings", "without the raw data that their row names: " + missing.text(),
              "import the campaign again");
    if (interrupted.empty() && partial.empty() && missing.empty())
      good("recordings", "every run is complete");
  }

  void marks() {
    Names excluded, alarmed;
    for (const Run& run : data_.runs) {
      if (!run.excluded.empty())
        excluded.add(fmt::format("{} ({})", run.run, run.excluded));
      else if (!run.alarms.empty())
        alarmed.add(fmt::format("{} ({})", run.run, run.alarms));
    }
    if (!excluded.empty())
      note("exclusions", "kept, and left out of what is derived: " + excluded.text(),
           "`tunnelrig serve` shows their notes; the live page of `log` takes them in again");
    if (!alarmed.empty())
      note("alarms", "while recording: " + alarmed.text(), "look at these runs; redo or exclude them");
  }

  void ledgers() {
    Names open, lossy, much, refused, again;
    std::uint64_t lost = 0, emitted = 0;
    for (const auto& [name, run] : data_.raw) {
      const auto ledger = ledger_of(file_, run.id);
      std::uint64_t in_gaps = 0;
      for (const Gap& gap : gaps_of(file_, run.id)) in_gaps += gap.frames_lost;
      if (ledger &&
          (!ledger->closed() || ledger->frames_stored != run.frames || ledger->frames_lost != in_gaps))
        open.add(name);
      if (ledger && ledger->packets_corrupt > 0)
        refused.add(fmt::format("{} ({})", name, ledger->packets_corrupt));
      if (ledger && much_came_again(*ledger))
        again.add(fmt::format("{} ({})", name, ledger->frames_duplicate));
      // Of an imported run the gaps are all that is known.
      const std::uint64_t run_lost = ledger ? ledger->frames_lost : in_gaps;
      const std::uint64_t run_emitted = ledger ? ledger->frames_emitted : run.frames + in_gaps;
      lost += run_lost;
      emitted += run_emitted;
      if (run_lost > 0) lossy.add(name);
      if (static_cast<double>(run_lost) > kMuchLost * static_cast<double>(run_emitted)) much.add(name);
    }
    if (!open.empty())
      problem("loss ledger", "emitted is not stored plus lost in " + open.text(),
              "do not trust these runs; record them again");
    if (!much.empty())
      problem("losses", "more than 1 % of the frames lost in " + much.text(),
              "check cable, hub and disk; record them again");
    else if (!lossy.empty())
      note("losses", fmt::format("{} of {} frames, in {}", lost, emitted, lossy.text()), "");
    if (!refused.empty())
      note("packets", "refused: " + refused.text(),
           "their checksums are wrong, or their numbers are not believed: check cable and firmware");
    if (!again.empty())
      note("packets", "frames under numbers that had passed, dropped: " + again.text(),
           "the link sends twice, or the board restarts without a new boot id (docs/wire-format.md)");
    if (open.empty() && lossy.empty()) good("loss ledger", "closed for every run, nothing lost");
  }

  void calibration() {
    const bool needed = !data_.raw.empty();
    if (!needed) return;
    const auto points = file_.calibration_points();
    if (!data_.certificate) {
      problem("calibration", "none, so no run can be reduced",
              points.empty() ? "`tunnelrig calibrate --points calibration.csv`" : "`tunnelrig calibrate`");
      return;
    }
    if (data_.certificate->points_hash != hash_of(points, file_.propeller_tests())) {
      problem("calibration", "made from other points than the file holds", "`tunnelrig calibrate`");
    }
    Names failed;
    for (const CalibrationGate& gate : data_.certificate->gates) {
      if (!gate.passed) failed.add(fmt::format("cell {} {} ({})", gate.cell, gate.name, gate.finding));
    }
    if (!failed.empty())
      problem("calibration", "gates not passed: " + failed.text(),
              "look at the certificate; calibrate these cells again");
    else
      good("calibration", fmt::format("certificate {} passed all gates", data_.certificate_id));
  }

  void tares() {
    std::set<std::string> tared, all;
    for (const std::size_t tare : tare_runs(data_)) tared.insert(data_.runs[tare].session);
    for (const Run& run : data_.runs)
      if (run.kind == RunKind::kThrust && run.excluded.empty() && data_.raw.contains(run.run))
        all.insert(run.session);
    Names without;
    for (const std::string& session : all) {
      if (!tared.contains(session)) without.add(session);
    }
    if (without.empty()) {
      if (!all.empty()) good("tares", "every session has one");
      return;
    }
    note("tares",
         fmt::format("none in {}: their zero is the calibration's, extrapolated from {:.1f} N",
                     without.text(), lowest_calibrated_N()),
         "record a tare (motors stopped) before and after each session: `tunnelrig log --kind tare`");
  }

  void channels() {
    Names stuck, dead, clipped, flagged, pattern, overloaded;
    for (const Run& run : data_.runs) {
      const auto statistics = data_.statistics.find(run.run);
      if (statistics == data_.statistics.end() || !run.excluded.empty()) continue;
      const auto raw = data_.raw.find(run.run);
      const bool counts = raw != data_.raw.end() && is_counts(raw->second.format.type);
      const auto ledger = raw == data_.raw.end() ? std::nullopt : ledger_of(file_, raw->second.id);
      if (ledger && ledger->frames_test_pattern > 0) pattern.add(run.run);
      if (ledger && ledger->frames_clipped > 0)
        flagged.add(fmt::format("{} ({:.2g} %)", run.run,
                                100.0 * static_cast<double>(ledger->frames_clipped) /
                                    static_cast<double>(ledger->frames_stored)));
      for (int rotor = 0; rotor < data_.info.rig.rotors; ++rotor) {
        const ChannelStatistics& channel = statistics->second.channels[static_cast<std::size_t>(rotor)];
        const std::string name = fmt::format("{} channel {}", run.run, rotor + 1);
        if (channel.stuck())
          stuck.add(name);
        else if (run.kind == RunKind::kThrust && counts &&
                 channel.std_V < kDeadNoise_counts * data_.info.daq.volts_per_count())
          dead.add(name);
        if (channel.clipped > 0) {
          clipped.add(fmt::format(
              "{} ({:.2g} %)", name,
              100.0 * static_cast<double>(channel.clipped) / static_cast<double>(statistics->second.frames)));
        }
        if (data_.certificate && run.kind == RunKind::kThrust &&
            data_.certificate->force(rotor + 1, channel.mean_V).extrapolated)
          overloaded.add(name);
      }
    }
    if (!stuck.empty())
      problem("channels", "stuck, never change: " + stuck.text(),
              "check cell, amplifier and plug; record these runs again");
    if (!dead.empty())
      problem("channels", "dead, less noise than a converter has: " + dead.text(),
              "check cell, amplifier and plug");
    if (!clipped.empty())
      problem("channels", "clipped: " + clipped.text(),
              "lower the amplifier's gain; clipped means are biased");
    if (!flagged.empty())
      problem("channels", "the board flags frames as clipped: " + flagged.text(),
              "lower the amplifier's gain; clipped means are biased");
    if (!pattern.empty())
      problem("channels", "the board's test pattern, no measurements: " + pattern.text(),
              "exclude these runs and record them again without the test pattern");
    if (!overloaded.empty())
      note("channels", "mean thrust outside the calibrated forces: " + overloaded.text(),
           "calibrate over the range that is measured");
    if (stuck.empty() && dead.empty() && clipped.empty() && flagged.empty() && pattern.empty())
      good("channels", "none stuck, dead or clipped");
  }

  void metadata() {
    for (const auto& [column, why, severity] :
         {std::tuple<const char*, const char*, Severity>{
              "air_temperature_C", "without it there is no density, and the run is left out",
              Severity::kProblem},
          {"speed_rpm", "the speed is taken for nominal", Severity::kNote},
          {"air_pressure_Pa", "the pressure is taken for 101325 Pa; a front changes C_T by a per cent",
           Severity::kNote}}) {
      Names missing;
      for (const Run& run : data_.runs) {
        if (run.kind == RunKind::kThrust && run.excluded.empty() && !run.number(column)) missing.add(run.run);
      }
      if (missing.empty()) continue;
      findings_.push_back(
          {severity, "metadata", fmt::format("{} is missing in {}", column, missing.text()), why});
    }
  }

  void speeds() {
    Names off, disagree;
    const double nominal = data_.info.rig.nominal_speed_rpm;
    for (const Run& run : data_.runs) {
      const auto read = run.number("speed_rpm");
      if (run.kind != RunKind::kThrust || !read || !run.excluded.empty()) continue;
      if (std::abs(*read / nominal - 1) > kSpeedTolerance)
        off.add(fmt::format("{} ({:.0f})", run.run, *read));
      const auto statistics = data_.statistics.find(run.run);
      if (statistics == data_.statistics.end()) continue;
      for (const ChannelStatistics& channel : statistics->second.channels) {
        if (!channel.shaft_hz || std::abs(*channel.shaft_hz * 60 / *read - 1) < kTachometerAgrees) continue;
        disagree.add(fmt::format("{} ({:.0f} against {:.0f})", run.run, *channel.shaft_hz * 60, *read));
        break;
      }
    }
    if (!off.empty())
      note("speed",
           fmt::format("further than {:.0f} rev/min from nominal: {}", kSpeedTolerance * nominal, off.text()),
           "set the speed again; `reduce --with rotor_speed` uses the measured one");
    if (!disagree.empty())
      problem("speed", "shaft line and tachometer disagree in " + disagree.text(),
              "find out which is right before reducing with rotor_speed");
  }

  void drifts() {
    Names moving;
    for (const auto& [name, statistics] : data_.statistics) {
      if (excluded_.contains(name)) continue;
      const bool still = std::all_of(statistics.channels.begin(), statistics.channels.end(),
                                     [](const auto& channel) { return channel.stationary(); });
      if (!still) moving.add(name);
    }
    if (!moving.empty())
      note("drift", "means that move by more than the run's noise explains: " + moving.text(),
           "let motors and cells warm up before a run");
  }

  void thrusts() {
    if (const auto doubt = implausible_thrust(data_)) problem("thrusts", doubt->found, doubt->advice);
  }

  void rates() {
    Names wrong;
    for (const auto& [name, run] : data_.raw) {
      const auto ledger = ledger_of(file_, run.id);
      if (ledger && ledger->board_rate_hz &&
          std::abs(*ledger->board_rate_hz / data_.info.daq.sample_rate_hz - 1) > kRateAgrees) {
        wrong.add(fmt::format("{} ({:.2f} Hz)", name, *ledger->board_rate_hz));
      }
    }
    if (!wrong.empty())
      problem("sample rate",
              fmt::format("the board's is not the {:.3f} Hz of campaign.toml: {}",
                          data_.info.daq.sample_rate_hz, wrong.text()),
              "set daq.sample_rate_hz; frequencies and times are off by as much");
  }

 private:
  std::string hash_of(const RawRun& run) const {
    struct Hash : FrameSink {
      explicit Hash(const RawFormat& format) : hasher(format) {}
      void frames(std::span<const std::byte> data) override { hasher.add(data); }
      void gap(const Gap& gap) override { gaps.push_back(gap); }
      RawHasher hasher;
      std::vector<Gap> gaps;
    } sink(run.format);
    read_raw(file_, run, sink);
    return sink.hasher.finish(sink.gaps);
  }

  static std::string hash_of(const std::vector<CalibrationPoint>& points,
                             const std::vector<PropellerTest>& tests) {
    return tunnelrig::hash_of(points, tests);
  }

  double lowest_calibrated_N() const {
    double lowest = 0;
    if (data_.certificate) {
      for (const CellFit& cell : data_.certificate->cells) lowest = std::max(lowest, cell.lowest_force_N);
    }
    return lowest;
  }

  void good(const std::string& check, const std::string& found) {
    findings_.push_back({Severity::kGood, check, found, ""});
  }
  void note(const std::string& check, const std::string& found, const std::string& advice) {
    findings_.push_back({Severity::kNote, check, found, advice});
  }
  void problem(const std::string& check, const std::string& found, const std::string& advice) {
    findings_.push_back({Severity::kProblem, check, found, advice});
  }

  const CampaignFile& file_;
  const CampaignData& data_;
  std::set<std::string> excluded_;  // runs; nothing is derived from them
  std::vector<Finding> findings_;
};

}  // namespace

std::vector<Finding> examine(const CampaignFile& file, const CampaignData& data,
                             const std::function<void(std::size_t, std::size_t)>& progress) {
  Examination examination(file, data);
  examination.integrity();
  examination.raw_data(progress);
  examination.states();
  examination.marks();
  examination.ledgers();
  examination.calibration();
  examination.tares();
  examination.channels();
  examination.metadata();
  examination.speeds();
  examination.drifts();
  examination.thrusts();
  examination.rates();
  return examination.take();
}

}  // namespace tunnelrig
