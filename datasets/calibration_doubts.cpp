#include "datasets/calibration_doubts.h"

#include "datasets/plausible.h"
#include "datasets/raw_store.h"
#include "datasets/statistics_store.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>

#include <fmt/format.h>

namespace tunnelrig {
namespace {

using Points = std::vector<CalibrationPoint>;

/// A cell larger than its rotor needs is calibrated with larger loads than a rotor gives, but not beyond what
/// it carries; small rotors are measured with cells made for larger ones.
double most_load_N(const Rig& rig) {
  constexpr double kOfRotor = 5, kOfCell = 2;
  return std::max(kOfRotor * most_rotor_thrust_N(rig, rig.nominal_speed_rpm), kOfCell * rig.cell_limit_N);
}

std::string doubt_readings(const CampaignInfo& info, const Points& points) {
  const auto beyond = [&info](double value) { return beyond_converter(info.daq, value); };
  const auto found = std::find_if(points.begin(), points.end(),
                                  [&](const CalibrationPoint& point) { return beyond(point.voltage_V); });
  if (found == points.end()) return "";
  const double most_N = most_load_N(info.rig);
  const bool exchanged = std::all_of(points.begin(), points.end(), [&](const CalibrationPoint& point) {
    return !beyond(point.applied_force_N) && std::abs(point.voltage_V) <= most_N;
  });
  return fmt::format(
      "calibration.csv:{}: column voltage_V: {:g} V is beyond the converter's reference of {:g} V "
      "(daq.adc_reference_V): {}",
      found->line, found->voltage_V, info.daq.adc_reference_V,
      exchanged ? "are voltage_V and applied_force_N exchanged?" : "are these volts (not mV or counts)?");
}

std::string doubt_loads(const Rig& rig, const Points& points) {
  const double most_N = most_load_N(rig);
  for (const CalibrationPoint& point : points) {
    if (std::abs(point.applied_force_N) <= most_N) continue;
    return fmt::format(
        "calibration.csv:{}: column applied_force_N: {:g} N is far more than a rotor of {:g} m radius gives "
        "at {:g} rev/min ({:.3g} N at most) and a cell carries (rig.cell_limit_N, {:g}): are these newtons "
        "(not grams)?",
        point.line, point.applied_force_N, rig.propeller_radius_m, rig.nominal_speed_rpm,
        most_rotor_thrust_N(rig, rig.nominal_speed_rpm), rig.cell_limit_N);
  }
  return "";
}

/// Ordinary least squares; the certificate's fit is a finer one, and refuses what this one passes over.
struct Line {
  double zero_V = 0, gain_V_per_N = 0;
};
std::optional<Line> line_through(const Points& points, int cell) {
  double n = 0, force = 0, volts = 0, force_force = 0, force_volts = 0;
  for (const CalibrationPoint& point : points) {
    if (point.cell != cell) continue;
    n += 1;
    force += point.applied_force_N;
    volts += point.voltage_V;
    force_force += point.applied_force_N * point.applied_force_N;
    force_volts += point.applied_force_N * point.voltage_V;
  }
  const double spread = n * force_force - force * force;
  if (!(spread > 0)) return {};
  const double gain = (n * force_volts - force * volts) / spread;
  if (gain == 0) return {};
  return Line{(volts - gain * force) / n, gain};
}

/// What a cell reads in one thrust run, and the most that its rotor can give there.
struct Reading {
  double mean_V = 0, most_N = 0;
};
using Readings = std::vector<std::vector<Reading>>;  // by rotor

/// Without what no converter has read, whose units are doubted by themselves.
Readings readings_of(const CampaignFile& file, const CampaignInfo& info) {
  const Rig& rig = info.rig;
  Readings readings(static_cast<std::size_t>(rig.rotors));
  const auto statistics = all_statistics(file);
  std::map<std::string, std::int64_t> ids;
  for (const RawRun& raw : raw_runs(file)) ids[raw.run] = raw.id;
  for (const Run& run : file.runs()) {
    const auto id = ids.find(run.run);
    if (run.kind != RunKind::kThrust || !run.excluded.empty() || id == ids.end()) continue;
    const auto found = statistics.find(id->second);
    if (found == statistics.end()) continue;
    const double most_N = most_rotor_thrust_N(rig, run.number("speed_rpm").value_or(rig.nominal_speed_rpm));
    for (std::size_t rotor = 0; rotor < readings.size() && most_N > 0; ++rotor) {
      const double mean_V = found->second.channels.at(rotor).mean_V;
      if (!beyond_converter(info.daq, mean_V)) readings[rotor].push_back({mean_V, most_N});
    }
  }
  return readings;
}

double largest_load_N(const Points& points, int cell) {
  double largest_N = 0;
  for (const CalibrationPoint& point : points)
    if (point.cell == cell) largest_N = std::max(largest_N, std::abs(point.applied_force_N));
  return largest_N;
}

/// The median over the runs, since single runs have a broken cell or a plug pulled out. The zero is the
/// line's, which is extrapolated and has moved since: on a cell that is large for its rotor by more than a
/// thrust.
std::string doubt_forces(const CampaignInfo& info, const Points& points, const Readings& readings) {
  constexpr double kZeroMoves = 0.2;  // of the largest load
  for (int rotor = 1; rotor <= info.rig.rotors; ++rotor) {
    std::vector<Reading> runs = readings[static_cast<std::size_t>(rotor - 1)];
    const auto line = line_through(points, rotor);
    if (!line || runs.empty()) continue;
    const auto force_N = [&line](const Reading& run) {
      return (run.mean_V - line->zero_V) / line->gain_V_per_N;
    };
    const auto middle = runs.begin() + static_cast<std::ptrdiff_t>(runs.size() / 2);
    std::nth_element(runs.begin(), middle, runs.end(), [&](const Reading& a, const Reading& b) {
      return std::abs(force_N(a)) / a.most_N < std::abs(force_N(b)) / b.most_N;
    });
    const double moved_N = kZeroMoves * largest_load_N(points, rotor);
    if (std::abs(force_N(*middle)) <= middle->most_N + moved_N) continue;
    return fmt::format(
        "calibration.csv: by the points of cell {} the {:.3g} V of a thrust run are {:.3g} N, more than a "
        "rotor of {:g} m radius gives at this speed ({:.3g} N at most): are its forces newtons (not grams), "
        "its readings volts, rig.propeller_radius_m and the speed right?",
        rotor, middle->mean_V, force_N(*middle), info.rig.propeller_radius_m, middle->most_N);
  }
  return "";
}

}  // namespace

std::vector<std::string> calibration_doubts(const CampaignFile& file, const Points& points) {
  const CampaignInfo info = file.info();
  std::string doubt = doubt_readings(info, points);
  if (doubt.empty()) doubt = doubt_loads(info.rig, points);
  if (doubt.empty()) doubt = doubt_forces(info, points, readings_of(file, info));
  if (doubt.empty()) return {};
  return {doubt};
}

}  // namespace tunnelrig
