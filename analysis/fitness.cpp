// The doctor's second half: whether a campaign is fit to be reduced and mapped.
#include "analysis/findings.h"
#include "analysis/implausible_thrust.h"
#include "analysis/misread_runs.h"
#include "analysis/reduction.h"
#include "analysis/spectrum.h"
#include "analysis/unused_conditions.h"
#include "datasets/error.h"
#include "datasets/recorded_rate.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

namespace tunnelrig {
namespace {

constexpr double kMovesC_T_percent = 0.3;    // on average: half of what the tolerance of the speed does
constexpr double kTachometerAgrees = 0.005;  // shaft line against tachometer

std::string with_share(const std::string& name, std::uint64_t frames, std::uint64_t of) {
  return fmt::format("{} ({:.2g} %)", name, 100.0 * static_cast<double>(frames) / static_cast<double>(of));
}

/// Runs, or channels of runs, by what is wrong with them.
struct ChannelFaults {
  Names single, stuck, dead, clipped, overloaded;
  Names flagged, erroneous, pattern;  // by the board itself

  void add_flags(const std::string& run, const Ledger& ledger) {
    if (ledger.frames_test_pattern > 0) pattern.add(run);
    if (ledger.frames_clipped > 0) flagged.add(with_share(run, ledger.frames_clipped, ledger.frames_stored));
    if (ledger.frames_adc_error > 0)
      erroneous.add(with_share(run, ledger.frames_adc_error, ledger.frames_stored));
  }
};

class Fitness : public Findings {
 public:
  Fitness(const CampaignFile& file, const CampaignData& data) : file_(file), data_(data) {}

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
    try {
      tares_of(data_);
    } catch (const InputError& error) {
      problem("tares", error.what(),
              "`reduce`, and all that comes after it, refuses the campaign until then");
      return;
    }
    std::set<std::string> tared, all;
    for (const std::size_t tare : recorded_runs(data_, RunKind::kTare))
      tared.insert(data_.runs[tare].session);
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
         fmt::format("none in {}: their zero is the calibration's, extrapolated{}", without.text(),
                     data_.certificate ? fmt::format(" from {:.1f} N", lowest_calibrated_N()) : ""),
         "record a tare (motors stopped) before and after each session: `tunnelrig log --kind tare`");
  }

  /// What a map needs and nothing else does.
  void geometry() {
    const Rig& rig = data_.info.rig;
    if (!data_.info.tunnel || rig.rotors != kMaxRotors) return;
    Names missing;
    if (rig.vehicle_width_m <= 0) missing.add("rig.vehicle_width_m");
    if (rig.vehicle_height_m <= 0) missing.add("rig.vehicle_height_m");
    if (!missing.empty())
      note("geometry", "campaign.toml has [tunnel] without " + missing.text(),
           "`map` refuses without: write them there (metres, tip to tip) and import the campaign again");
  }

  void channels() {
    const ChannelFaults faults = channel_faults();
    bool well = true;
    const auto report = [&](const Names& names, const char* what, const char* advice) {
      if (names.empty()) return;
      problem("channels", what + names.text(), advice);
      well = false;
    };
    report(faults.single,
           "one frame only, too short for a mean: ", "record these runs again, or exclude them");
    report(faults.stuck, "stuck, never change: ", "check cell, amplifier and plug; record these runs again");
    report(faults.dead, "dead, less noise than a converter has: ", "check cell, amplifier and plug");
    report(faults.clipped, "clipped: ", "lower the amplifier's gain; clipped means are biased");
    report(faults.flagged,
           "the board flags frames as clipped: ", "lower the amplifier's gain; clipped means are biased");
    report(faults.erroneous,
           "the board flags frames as errors of its converter: ", "exclude these runs and record them again");
    report(faults.pattern, "the board's test pattern, no measurements: ",
           "exclude these runs and record them again without the test pattern");
    if (!faults.overloaded.empty())
      note("channels", "mean thrust outside the calibrated forces: " + faults.overloaded.text(),
           "calibrate over the range that is measured");
    if (well) good("channels", "none stuck, dead or clipped");
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
      add({severity, "metadata", fmt::format("{} is missing in {}", column, missing.text()), why});
    }
  }

  /// What the thesis's model holds constant and was recorded otherwise.
  void conditions() {
    std::vector<std::size_t> runs;
    for (std::size_t r = 0; r < data_.runs.size(); ++r)
      if (data_.runs[r].kind == RunKind::kThrust && data_.runs[r].excluded.empty()) runs.push_back(r);
    for (const UnusedCondition& condition : unused_conditions(data_, runs)) {
      if (std::abs(condition.c_t_percent) < kMovesC_T_percent) continue;
      note(condition.quantity,
           fmt::format("{} by the thesis's model; as recorded ({} on average) it makes C_T {}",
                       condition.taken_for, condition.mean_text,
                       UnusedCondition::change(condition.c_t_percent)),
           fmt::format("U95 does not hold that: `reduce --with {}` takes it in", condition.term));
    }
  }

  void speeds() {
    std::vector<std::pair<double, std::string>> far;  // by how much of nominal
    Names disagree;
    const double nominal = data_.info.rig.nominal_speed_rpm;
    for (const Run& run : data_.runs) {
      const auto read = run.number("speed_rpm");
      if (run.kind != RunKind::kThrust || !read || !run.excluded.empty()) continue;
      if (const double by = std::abs(*read / nominal - 1); by > kSpeedTolerance)
        far.emplace_back(by, fmt::format("{} ({:.0f})", run.run, *read));
      const auto statistics = data_.statistics.find(run.run);
      if (statistics == data_.statistics.end()) continue;
      const auto shaft_hz = middle_shaft_hz(statistics->second);
      if (shaft_hz && std::abs(60 * *shaft_hz - *read) > tolerance_rpm(statistics->second, *read))
        disagree.add(fmt::format("{} ({:.0f} against {:.0f})", run.run, 60 * *shaft_hz, *read));
    }
    std::ranges::stable_sort(far, std::greater{}, &std::pair<double, std::string>::first);
    Names off;
    for (const auto& [by, run] : far) off.add(run);
    if (!off.empty())
      note("speed",
           fmt::format("further than {:.0f} rev/min from nominal, the furthest first: {}",
                       kSpeedTolerance * nominal, off.text()),
           "set the speed again; `reduce --with rotor_speed` uses the measured one");
    if (!disagree.empty())
      problem("speed", "shaft line and tachometer disagree in " + disagree.text(),
              "find out which is right before reducing with rotor_speed");
  }

  void drifts() {
    Names moving;
    for (const Run& run : data_.runs) {
      const auto statistics = data_.statistics.find(run.run);
      if (statistics == data_.statistics.end() || !run.excluded.empty()) continue;
      const auto& channels = statistics->second.channels;
      const bool still = std::all_of(channels.begin(), channels.end(),
                                     [](const auto& channel) { return channel.stationary(); });
      if (!still) moving.add(run.run);
    }
    if (!moving.empty())
      note("drift", "means that move by more than the run's noise explains: " + moving.text(),
           "let motors and cells warm up before a run");
  }

  void thrusts() {
    const auto doubt = implausible_thrust(data_);
    if (!doubt) return;
    if (doubt->certain)
      problem("thrusts", doubt->found, doubt->advice);
    else
      note("thrusts", doubt->found, doubt->advice);
  }

  void misread() {
    const MisreadRuns runs = misread_runs(data_);
    const Names tares(runs.loaded_tares), broken(runs.broken_off);
    if (!tares.empty())
      problem("tares", "loaded like thrust runs: " + tares.text(),
              "correct their kind in runs.csv, or exclude them: they shift the zero of their session");
    if (!broken.empty())
      problem("thrusts", "not one state, their means are known to no better than 5 %: " + broken.text(),
              "did a motor stop within the run? Exclude these runs and record them again");
  }

  void rates() {
    Names wrong;
    for (const auto& [name, run] : data_.raw) {
      const auto ledger = ledger_of(file_, run.id);
      if (ledger && is_another_rate(ledger->board_rate_hz, data_.info.daq.sample_rate_hz)) {
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
  /// Short runs have wide bins, and a line is not known better than a part of one.
  double tolerance_rpm(const RunStatistics& statistics, double speed_rpm) const {
    const std::size_t window = welch_window(statistics.frames);
    const double bin_rpm = window == 0 ? 0 : 60 * data_.info.daq.sample_rate_hz / static_cast<double>(window);
    return std::max(kTachometerAgrees * speed_rpm, 2 * kLineError_bins * bin_rpm);
  }

  ChannelFaults channel_faults() const {
    ChannelFaults faults;
    for (const Run& run : data_.runs) {
      const auto statistics = data_.statistics.find(run.run);
      if (statistics == data_.statistics.end() || !run.excluded.empty()) continue;
      const auto raw = data_.raw.find(run.run);
      if (raw != data_.raw.end())
        if (const auto ledger = ledger_of(file_, raw->second.id)) faults.add_flags(run.run, *ledger);
      if (statistics->second.frames == 1) {  // it cannot change, whatever the cell does
        faults.single.add(run.run);
        continue;
      }
      const bool counts = raw != data_.raw.end() && is_counts(raw->second.format.type);
      for (int rotor = 0; rotor < data_.info.rig.rotors; ++rotor)
        add_faults(run, rotor, statistics->second, counts, faults);
    }
    return faults;
  }

  /// Of one channel, of counts or of volts.
  void add_faults(const Run& run, int rotor, const RunStatistics& statistics, bool counts,
                  ChannelFaults& faults) const {
    const ChannelStatistics& channel = statistics.channels[static_cast<std::size_t>(rotor)];
    const std::string name = fmt::format("{} channel {}", run.run, rotor + 1);
    const bool thrust = run.kind == RunKind::kThrust;
    if (channel.stuck())
      faults.stuck.add(name);
    else if (thrust && counts && channel.std_V < kDeadNoise_counts * data_.info.daq.volts_per_count())
      faults.dead.add(name);
    if (channel.clipped > 0) faults.clipped.add(with_share(name, channel.clipped, statistics.frames));
    if (thrust && data_.certificate && data_.certificate->force(rotor + 1, channel.mean_V).extrapolated)
      faults.overloaded.add(name);
  }

  double lowest_calibrated_N() const {
    double lowest = 0;
    if (data_.certificate) {
      for (const CellFit& cell : data_.certificate->cells) lowest = std::max(lowest, cell.lowest_force_N);
    }
    return lowest;
  }

  const CampaignFile& file_;
  const CampaignData& data_;
};

}  // namespace

std::vector<Finding> fitness(const CampaignFile& file, const CampaignData& data) {
  Fitness checks(file, data);
  checks.calibration();
  checks.tares();
  checks.geometry();
  checks.channels();
  checks.metadata();
  checks.conditions();
  checks.speeds();
  checks.drifts();
  checks.thrusts();
  checks.misread();
  checks.rates();
  return checks.take();
}

}  // namespace tunnelrig
