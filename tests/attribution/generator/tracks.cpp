#include "attribution/generator/tracks.h"

#include "datasets/error.h"

#include <set>

namespace tunnelrig::attribution {
namespace {

using Places = Design::Places;

/// Effects that a single campaign of reduced thrusts can tell from all others. Steps are not among them: a
/// step of a cell's zero and one of a rotor's gain look alike at the few sigmas that a change between
/// sessions has.
constexpr std::array kIdentifiable = {"air_pressure",
                                      "air_humidity",
                                      "rotor_speed",
                                      "supply_voltage",
                                      "motor_warm_up",
                                      "wake_recirculation",
                                      "axial_wind",
                                      "creep",
                                      "hysteresis",
                                      "zero_drift_time",
                                      "zero_drift_temperature",
                                      "span_drift_temperature",
                                      "temperature_gradient",
                                      "ground_effect",
                                      "ceiling_effect"};

/// Effects with a signature inside the run, for raw campaigns.
constexpr std::array kWithinRun = {"motor_warm_up", "wake_recirculation", "creep",
                                   "mains_pickup",  "vibration_alias",    "adc_clipping"};

/// Pairs that are clear of one another when both act at once; two of one covariate are not asked for.
constexpr std::array kForTwo = {"air_pressure", "rotor_speed", "supply_voltage",         "motor_warm_up",
                                "axial_wind",   "creep",       "span_drift_temperature", "zero_drift_time"};

constexpr std::array kOutside = {"humidity_wave", "voltage_band", "time_of_day_arch", "temperature_kink",
                                 "cable_wave"};

/// The same where switches and texts are written down.
constexpr std::array kSwitched = {"fan_switch", "blade_sets"};

struct Pair {
  const char* truth;
  const char* other;
  Places places;
  double sign;
  bool sagging_supply;
};

constexpr double kLevel = 0.004;  // spread of thrust at which a gain and an offset look alike
constexpr double kWide = 0.28;    // and at which they do not

constexpr std::array<Pair, 10> kPairs = {{
    {"span_drift_temperature", "zero_drift_temperature", Places::kGrid, 0, false},
    {"zero_drift_temperature", "span_drift_temperature", Places::kGrid, 0, false},
    {"propeller_step", "mounting_step", Places::kGrid, 0, false},
    {"mounting_step", "propeller_step", Places::kGrid, 0, false},
    {"reynolds_number", "tip_mach", Places::kGrid, 1, false},
    {"supply_voltage", "zero_drift_time", Places::kGrid, 0, true},
    {"creep", "wake_recirculation", Places::kTunnel, 0, false},
    {"wake_recirculation", "creep", Places::kTunnel, 1, false},
    {"motor_warm_up", "wake_recirculation", Places::kTunnel, 0, false},
    {"wake_recirculation", "motor_warm_up", Places::kTunnel, -1, false},
}};

Design design_for(const std::string& effect) {
  Design design;
  if (effect == "motor_warm_up" || effect == "wake_recirculation" || effect == "creep") {
    design.places = Places::kReference;
  }
  if (effect == "ground_effect" || effect == "ceiling_effect") design.places = Places::kOpenSpace;
  if (effect == "air_humidity") design.hot_weather = true;
  for (const char* name : {"zero_drift_temperature", "span_drift_temperature", "zero_drift_time",
                           "mounting_step", "propeller_step", "temperature_gradient", "reynolds_number"}) {
    if (effect == name) design.thrust_spread = kWide;
  }
  if (effect == "zero_drift_temperature" || effect == "span_drift_temperature" ||
      effect == "temperature_gradient") {
    design.cell_swing_K = 3.5;
  }
  return design;
}

Design join(const Design& a, const Design& b) {
  Design both = a;
  if (b.places != Places::kGrid) both.places = b.places;
  both.thrust_spread = std::max(a.thrust_spread, b.thrust_spread);
  both.cell_swing_K = std::max(a.cell_swing_K, b.cell_swing_K);
  both.hot_weather = a.hot_weather || b.hot_weather;
  return both;
}

/// Two effects that act through the same covariate share it instead of standing apart.
bool clash(std::string_view a, std::string_view b) {
  const std::set<std::string_view> warm = {"creep", "motor_warm_up"};
  return a == b || (warm.contains(a) && warm.contains(b));
}

Truth draw_two(const Settings& settings, Random& random) {
  Truth truth{.effects = settings.effects};
  if (truth.effects.empty()) {
    const std::string first = kForTwo[random.below(kForTwo.size())];
    std::string second = first;
    while (clash(first, second)) second = kForTwo[random.below(kForTwo.size())];
    truth.effects = {first, second};
  }
  if (truth.effects.size() != 2)
    throw InputError("--track two: name two effects (--effect A --effect B), or none");
  truth.design = join(design_for(truth.effects[0]), design_for(truth.effects[1]));
  return truth;
}

Truth draw_confounded(const Settings& settings, Random& random) {
  std::vector<Pair> pairs;
  for (const Pair& pair : kPairs) {
    const bool truth_fits = settings.effects.empty() || settings.effects[0] == pair.truth;
    if (truth_fits && (settings.effects.size() < 2 || settings.effects[1] == pair.other))
      pairs.push_back(pair);
  }
  if (pairs.empty())
    throw InputError("--track confounded: there is no pair of these effects (--list shows them)");
  const Pair pair = pairs[random.below(pairs.size())];
  Truth truth{.effects = {pair.truth}, .acceptable = {pair.truth, pair.other}, .sign = pair.sign};
  truth.design.places = pair.places;
  truth.design.sagging_supply = pair.sagging_supply;
  truth.design.cell_swing_K = design_for(pair.truth).cell_swing_K;
  if (truth.effects[0] == "reynolds_number") {
    // Pressure is in the Reynolds number and not in the Mach number; speed weighs less in it than
    // temperature. The Mach number does little at these speeds: in a steady climate it would need an exponent
    // that no blade has, and physics would tell the two apart. So this is a hall without heating.
    truth.design.pressure_swing_Pa = 50;
    truth.design.speed_scatter_rpm = 0.8;
    truth.design.warmth_swing_K = 12;
  }
  truth.design.thrust_spread = kLevel;
  return truth;
}

struct Hidden {
  const char* effect;
  const char* column;
};
constexpr std::array<Hidden, 4> kHidden = {{{"axial_wind", "tunnel_airspeed_m_s"},
                                            {"supply_voltage", "supply_voltage_V"},
                                            {"cable_wave", "cable_slack_mm"},
                                            {"motor_warm_up", "time_since_motor_start_s"}}};

Truth draw_hidden(const Settings& settings, Random& random) {
  std::vector<Hidden> choices;
  for (const Hidden& hidden : kHidden) {
    if (settings.effects.empty() || settings.effects[0] == hidden.effect) choices.push_back(hidden);
  }
  if (choices.empty()) throw InputError("--track not_recorded: the track does not have this effect");
  const Hidden chosen = choices[random.below(choices.size())];
  return {.effects = {chosen.effect}, .unrecorded = {chosen.column}, .design = design_for(chosen.effect)};
}

template <std::size_t size>
Truth draw_single(const Settings& settings, const std::array<const char*, size>& names, Random& random) {
  Truth truth{.effects = settings.effects};
  if (truth.effects.empty()) truth.effects = {names[random.below(size)]};
  if (truth.effects.size() != 1)
    throw InputError("this track has one effect; name one (--effect NAME), or none");
  truth.design = design_for(truth.effects[0]);
  return truth;
}

/// A campaign without an effect has the design of one that has, or the design would give it away.
Truth draw_none(Random& random) {
  Truth truth;
  const auto any = random.below(kIdentifiable.size() - 2);  // without the two of open space
  truth.design = design_for(kIdentifiable[any]);
  return truth;
}

}  // namespace

Truth draw_truth(const Settings& settings, int attempt) {
  Random random(settings.seed, attempt == 0 ? "truth" : fmt::format("truth, attempt {}", attempt));
  switch (settings.track) {
    case Track::kNone:
      if (!settings.effects.empty()) throw InputError("--track none: has no effect; leave --effect out");
      return draw_none(random);
    case Track::kOne:
      return settings.raw ? draw_single(settings, kWithinRun, random)
                          : draw_single(settings, kIdentifiable, random);
    case Track::kTwo:
      return draw_two(settings, random);
    case Track::kConfounded:
      return draw_confounded(settings, random);
    case Track::kOutside:
      return settings.switches ? draw_single(settings, kSwitched, random)
                               : draw_single(settings, kOutside, random);
    case Track::kNotRecorded:
      return draw_hidden(settings, random);
  }
  return {};
}

}  // namespace tunnelrig::attribution
