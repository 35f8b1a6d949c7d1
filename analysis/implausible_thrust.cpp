#include "analysis/implausible_thrust.h"

#include "analysis/conventions.h"
#include "analysis/upper_median.h"
#include "datasets/error.h"
#include "datasets/locations.h"
#include "datasets/plausible.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

namespace tunnelrig {
namespace {

/// Sums over the runs of a location.
struct RotorsOfLocation {
  double runs = 0, c_t = 0;
  std::array<double, kMaxRotors> thrust_N{}, of_most{};  // of_most: thrust over the most that a rotor gives
};

std::map<std::string, RotorsOfLocation> rotors_by_location(const CampaignData& data,
                                                           const Reduction& reduction) {
  std::map<std::string, RotorsOfLocation> locations;
  for (const RunCoefficients& run : reduction.runs) {
    RotorsOfLocation& location = locations[canonical_location(data.runs[run.run].location)];
    location.runs += 1;
    location.c_t += run.c_t;
    const double most_N = most_rotor_thrust_N(data.info.rig, run.speed_rpm);
    for (std::size_t rotor = 0; rotor < static_cast<std::size_t>(data.info.rig.rotors); ++rotor) {
      location.thrust_N[rotor] += run.thrust_N[rotor];
      location.of_most[rotor] += run.thrust_N[rotor] / most_N;
    }
  }
  return locations;
}

/// The rotor with the largest thrust of all, in either direction, for its size and speed.
struct LargestThrust {
  std::string location;
  std::size_t rotor = 0;
  double c_t = 0, thrust_N = 0, of_most = 0;
  std::size_t locations_beyond = 0;
};

LargestThrust largest_of(const std::map<std::string, RotorsOfLocation>& locations) {
  LargestThrust largest;
  for (const auto& [name, sums] : locations) {
    double here = 0;
    for (std::size_t rotor = 0; rotor < sums.of_most.size(); ++rotor) {
      const double of_most = std::abs(sums.of_most[rotor]) / sums.runs;
      here = std::max(here, of_most);
      if (of_most <= largest.of_most) continue;
      largest.location = name;
      largest.rotor = rotor;
      largest.c_t = sums.c_t / sums.runs;
      largest.thrust_N = sums.thrust_N[rotor] / sums.runs;
      largest.of_most = of_most;
    }
    largest.locations_beyond += here > 1 ? 1 : 0;
  }
  return largest;
}

double median_of_speeds(const Reduction& reduction) {
  std::vector<double> speeds;
  for (const RunCoefficients& run : reduction.runs) speeds.push_back(run.speed_rpm);
  return upper_median(std::move(speeds));
}

/// A rotor that pulls backwards in most runs. One that stands, beside others that turn, reads a little of
/// either sign; a run whose total is not above 0 is not reduced.
std::optional<ImplausibleThrust> wrong_sign(const CampaignData& data, const Reduction& reduction) {
  constexpr double kClear = 0.2;  // of the run's largest
  std::string found;
  for (std::size_t rotor = 0; rotor < static_cast<std::size_t>(data.info.rig.rotors); ++rotor) {
    std::vector<double> backwards_N, largest_N;
    for (const RunCoefficients& run : reduction.runs) {
      const double most_N = std::ranges::max(run.thrust_N);
      if (most_N < kLeastOverMostThrust * most_rotor_thrust_N(data.info.rig, run.speed_rpm)) continue;
      if (run.thrust_N[rotor] >= -kClear * most_N) continue;
      backwards_N.push_back(run.thrust_N[rotor]);
      largest_N.push_back(most_N);
    }
    const std::size_t runs = backwards_N.size();
    if (2 * runs <= reduction.runs.size()) continue;
    found += fmt::format("{}rotor {} gives {:.3g} N where another gives {:.3g} N, so in {} of {} runs",
                         found.empty() ? "" : "; ", rotor + 1, upper_median(std::move(backwards_N)),
                         upper_median(std::move(largest_N)), runs, reduction.runs.size());
  }
  if (found.empty()) return {};
  return ImplausibleThrust{
      found,
      "is its cell wired, or calibrated, with the wrong sign? Until that is mended neither "
      "U nor C_T means anything",
      true};
}

double of_one_rotor(double c_t, Convention convention) {
  Rig rig;
  rig.rotors = 1;
  rig.rotor_area_m2 = std::numbers::pi * rig.propeller_radius_m * rig.propeller_radius_m;
  return convert_coefficient(c_t, convention, Convention::kThesis, rig);
}

}  // namespace

std::optional<ImplausibleThrust> implausible_thrust(const CampaignData& data, const Reduction& reduction) {
  const auto locations = rotors_by_location(data, reduction);
  const LargestThrust largest = largest_of(locations);
  const bool too_much = largest.of_most > 1, too_little = largest.of_most < kLeastOverMostThrust;
  if (!too_much && !too_little) return wrong_sign(data, reduction);
  const double speed_rpm = median_of_speeds(reduction);
  const double limit_N =
      (too_much ? 1 : kLeastOverMostThrust) * most_rotor_thrust_N(data.info.rig, speed_rpm);
  const std::string where =
      too_much ? fmt::format("so at {} of {} locations", largest.locations_beyond, locations.size())
               : "no rotor gives more anywhere";
  return ImplausibleThrust{
      fmt::format("location {}: rotor {} gives {:.3g} N and C_T is {:.3g} (thesis); a rotor of {:g} m radius "
                  "gives {:.3g} N at {} at {:g} rev/min ({})",
                  largest.location, largest.rotor + 1, largest.thrust_N, largest.c_t,
                  data.info.rig.propeller_radius_m, limit_N, too_much ? "most" : "least", speed_rpm, where),
      fmt::format(
          "{} are rig.propeller_radius_m (no diameter) and rig.nominal_speed_rpm of campaign.toml right?",
          too_much ? "are the calibration's loads, its propeller tests or the thrusts in grams?"
                   : "are the calibration's loads or the thrusts in kilograms, its readings in mV?"),
      too_much};
}

std::optional<ImplausibleThrust> implausible_thrust(const CampaignData& data) {
  try {
    return implausible_thrust(data, reduce_runs(data, {}));
  } catch (const InputError&) {
    return {};  // nothing is reduced to anything implausible
  }
}

std::optional<ImplausibleThrust> implausible_thrust(const TableReduction& reduction) {
  const double most = kMostRotorCoefficient, least = kLeastOverMostThrust * kMostRotorCoefficient;
  std::size_t beyond = 0;
  bool any_too_much = false;
  std::string first;
  for (const TableGroup& group : reduction.groups) {
    double largest = 0;
    for (const std::size_t row : group.rows) largest = std::max(largest, std::abs(reduction.rows[row].c_t));
    const bool too_much = std::abs(of_one_rotor(group.median, reduction.convention)) > most;
    const bool too_little = of_one_rotor(largest, reduction.convention) < least;
    if (!too_much && !too_little) continue;
    any_too_much |= too_much;
    const double per_thesis = of_one_rotor(1, reduction.convention);
    if (++beyond == 1)
      first = fmt::format("group {}: {} C_T of {:.3g} is {} than any propeller's ({:.2g} at {})", group.name,
                          too_much ? "a median" : "its largest", too_much ? group.median : largest,
                          too_much ? "more" : "less", (too_much ? most : least) / per_thesis,
                          too_much ? "most" : "least");
  }
  if (beyond == 0) return {};
  return ImplausibleThrust{
      fmt::format("{}; so in {} of {} groups", first, beyond, reduction.groups.size()),
      "are thrust, speed and propeller diameter in the units that the schema gives them?", any_too_much};
}

}  // namespace tunnelrig
