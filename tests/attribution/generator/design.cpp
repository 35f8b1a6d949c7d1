#include "attribution/generator/design.h"

#include "attribution/generator/weather.h"
#include "datasets/locations.h"

#include <map>
#include <numbers>

namespace tunnelrig::attribution {
namespace {

constexpr double kFirstDay_s = 1772409600;  // Monday 2026-03-02, 00:00 UTC

struct Visit {
  std::string location;
  int repeat = 1;
};

std::vector<std::string> locations_of(Design::Places places) {
  if (places == Design::Places::kOpenSpace) return open_space_grid();
  std::vector<std::string> locations = tunnel_grid();
  if (places != Design::Places::kTunnel) locations.emplace_back("OS");
  return locations;
}

/// `count` visits, every location as often as every other but for a rest; repeat by repeat, in grid order.
std::vector<Visit> visits_of(const std::vector<std::string>& locations, int count, bool unequal,
                             Random& random) {
  std::vector<Visit> visits;
  for (int repeat = 1; static_cast<int>(visits.size()) < count; ++repeat) {
    for (const std::string& location : locations) {
      if (unequal && repeat > 2 && random.chance(0.35)) continue;
      if (static_cast<int>(visits.size()) < count) visits.push_back({location, repeat});
    }
  }
  return visits;
}

std::vector<Visit> plan_visits(const Settings& settings, const Design& design, Random& random) {
  const bool reference = design.places == Design::Places::kReference;
  const int at_reference = reference ? settings.runs / 4 : 0;
  std::vector<Visit> visits =
      visits_of(locations_of(design.places), settings.runs - at_reference, settings.unequal_repeats, random);
  if (settings.order == Order::kRandomised) random.shuffle(visits);
  // reference runs are spread evenly, so that every session has some
  for (int i = 0; i < at_reference; ++i) {
    const auto at = 4 * static_cast<std::ptrdiff_t>(i) + static_cast<std::ptrdiff_t>(random.below(4));
    visits.insert(visits.begin() + std::min(at, static_cast<std::ptrdiff_t>(visits.size())),
                  {"OS", settings.runs + i});
  }
  std::map<std::string, int> seen;
  for (Visit& visit : visits) visit.repeat = ++seen[visit.location];
  return visits;
}

/// Morning and afternoon sessions on working days, or one a day where they are long.
double session_start_s(int session, const Settings& settings, Random& random) {
  const int a_day = settings.runs > 24 * settings.blocks ? 1 : 2;
  const int day = session / a_day + session / (5 * a_day) * 2;
  const double hour = a_day == 2 && session % 2 == 1 ? 13.5 : 8;
  return kFirstDay_s + day * kDay_s + hour * 3600 + random.uniform(0, 3600);
}

void place(Conditions& run) {
  run.in_tunnel = grid_point(run.location).has_value();
  run.ground_distance_R = distance_of(run.location, "GND").value_or(kFar_R);
  run.ceiling_distance_R = distance_of(run.location, "CEIL").value_or(kFar_R);
}

/// What the rig does, run by run; it keeps the state that lasts from one run to the next.
class Rig {
 public:
  Rig(Random& random, const Weather& weather, const Design& design)
      : random_(random), weather_(weather), design_(design), cell_drift_(random, 1800, 20000) {}

  void begin_session() {
    speed_bias_rpm_ = random_.normal(0.45 * design_.speed_scatter_rpm);
    airspeed_m_s_ = random_.uniform(0.15, 1.1);
    cell_offset_K_ = random_.normal(1.2);
    full_supply_V_ = random_.uniform(15.1, 15.3);
    sag_V_h_ = random_.uniform(0.25, 0.5);
    slack_mm_ = random_.uniform(5, 35);
    supply_used_h_ = random_.uniform(0, 0.8);
    time_s_ = 0;
  }

  /// Conditions of the next run of a session that began at `session_start_s`; advances the clock.
  void meet(Conditions& run, double session_start_s) {
    run.time_since_motor_start_s = std::round(random_.log_uniform(20, 900));
    if (time_s_ > 0) time_s_ += run.time_since_motor_start_s;  // motors start when the rig stands
    run.session_time_h = time_s_ / 3600;
    run.start_s = session_start_s + time_s_;
    run.time_of_day_h = std::fmod(run.start_s, kDay_s) / 3600;
    const Air air = weather_.at(run.start_s, run.session_time_h);
    run.air_temperature_C = air.temperature_C;
    run.air_pressure_Pa = air.pressure_Pa;
    run.relative_humidity = air.humidity;
    run.speed_rpm = kNominalSpeed_rpm +
                    std::clamp(speed_bias_rpm_ + random_.normal(design_.speed_scatter_rpm), -15.0, 15.0);
    run.tunnel_airspeed_m_s = airspeed_m_s_ * random_.log_uniform(0.4, 2.2);
    run.cell_temperature_C = air.temperature_C + cell_offset_K_ +
                             2.5 * -std::expm1(-run.session_time_h / 0.8) +
                             design_.cell_swing_K * cell_drift_(run.start_s);
    run.supply_voltage_V = supply();
    run.cable_slack_mm = std::max(0.0, slack_mm_ + random_.normal(4));
    run.vibration = random_.log_uniform(0.2, 1);
    round_as_recorded(run);
    const double pause_s = random_.uniform(130, 260);
    supply_used_h_ += (run.time_since_motor_start_s + pause_s) / 3600;
    time_s_ += pause_s;
  }

 private:
  double supply() {
    if (design_.sagging_supply) return 15.2 - 0.16 * time_s_ / 3600;
    if (supply_used_h_ > 1.3) supply_used_h_ = 0;  // the battery is changed
    return full_supply_V_ - sag_V_h_ * supply_used_h_ + random_.normal(0.03);
  }

  /// Instruments show what happened; the digits are those of runs.csv.
  static void round_as_recorded(Conditions& run) {
    const auto to = [](double& value, double step) { value = std::round(value / step) * step; };
    to(run.start_s, 1);
    to(run.air_temperature_C, 0.01);
    to(run.cell_temperature_C, 0.01);
    to(run.cable_slack_mm, 0.1);
  }

  Random& random_;
  const Weather& weather_;
  const Design& design_;
  Course cell_drift_;
  double speed_bias_rpm_ = 0, airspeed_m_s_ = 0, cell_offset_K_ = 0, full_supply_V_ = 15, sag_V_h_ = 0,
         slack_mm_ = 0, supply_used_h_ = 0, time_s_ = 0;
};

double* condition(Conditions& run, const std::string& column) {
  const std::map<std::string, double*> known = {{"speed_rpm", &run.speed_rpm},
                                                {"air_temperature_C", &run.air_temperature_C},
                                                {"air_pressure_Pa", &run.air_pressure_Pa},
                                                {"relative_humidity", &run.relative_humidity},
                                                {"supply_voltage_V", &run.supply_voltage_V},
                                                {"tunnel_airspeed_m_s", &run.tunnel_airspeed_m_s},
                                                {"cell_temperature_C", &run.cell_temperature_C},
                                                {"time_since_motor_start_s", &run.time_since_motor_start_s},
                                                {"cable_slack_mm", &run.cable_slack_mm},
                                                {"time_of_day_h", &run.time_of_day_h}};
  const auto found = known.find(column);
  return found == known.end() ? nullptr : found->second;
}

/// Brings a run to a proposed setting. Thrust follows a speed that was chosen, whatever else is true.
void set(Conditions& run, const SeparatingRun& proposal) {
  run.proposed = true;
  for (const auto& [column, value] : proposal.setting) {
    if (double* target = condition(run, column)) *target = value;
  }
  if (proposal.setting.contains("speed_rpm")) {
    run.speed_factor = std::pow(run.speed_rpm / kNominalSpeed_rpm, 2);
  }
}

/// Some sessions more: the proposed runs, each beside one at the same location under ordinary conditions.
void add_separating_sessions(World& world, const Settings& settings, Rig& rig, Random& random) {
  std::map<std::string, int> repeats;
  for (const Conditions& run : world.runs)
    repeats[run.location] = std::max(repeats[run.location], run.repeat);
  for (int session = settings.blocks; session < settings.blocks + settings.separating_sessions; ++session) {
    rig.begin_session();
    const double start_s = session_start_s(session, settings, random);
    for (int i = 0; i < settings.separating_repeats; ++i) {
      for (const SeparatingRun& proposal : settings.separating) {
        for (const bool proposed : {false, true}) {
          Conditions run;
          run.session = session;
          run.added = true;
          run.location = proposal.location.empty() ? world.runs.front().location : proposal.location;
          run.repeat = ++repeats[run.location];
          place(run);
          rig.meet(run, start_s);
          if (proposed) set(run, proposal);
          world.runs.push_back(run);
        }
      }
    }
  }
}

/// Coefficients of the rotors at a location: one for all, and a little of each rotor's own.
Rotors coefficients(const Design& design, Random& random) {
  const double spread = design.thrust_spread;
  const double common = std::clamp(random.normal(spread), -2 * spread, 2 * spread);
  Rotors values{};
  for (double& value : values)
    value = 0.1056 / 4 * std::exp(common - 1.8 * spread + random.normal(0.2 * spread));
  return values;
}

/// What people do at the rig between runs. Every campaign has it; not every one writes it down.
void switch_about(World& world, Random& random) {
  double fan_on = 0;
  std::size_t blade_set = 0;
  for (Conditions& run : world.runs) {
    if (random.chance(0.3)) fan_on = 1 - fan_on;
    if (random.chance(0.3)) blade_set = random.below(kBladeSets);
    run.fan_on = fan_on;
    run.blade_set = blade_set;
  }
}

void lay_baseline(World& world, const Design& design, Random& random) {
  std::map<std::string, Rotors> known;
  const bool one_for_all = design.places == Design::Places::kOpenSpace;
  for (const Conditions& run : world.runs) {
    const std::string key = one_for_all ? "OS" : run.location;
    if (!known.contains(key)) known[key] = coefficients(design, random);
    Rotors thrust_N{};
    for (std::size_t rotor = 0; rotor < kRotors; ++rotor) {
      thrust_N[rotor] = known[key][rotor] * dynamic_thrust_N(run.air_temperature_C) * run.speed_factor;
    }
    world.baseline_N.push_back(thrust_N);
  }
}

}  // namespace

double dynamic_thrust_N(double air_temperature_C) {
  const double density_kg_m3 = kStandardPressure_Pa / (kGasConstant_J_kgK * (air_temperature_C + 273.15));
  const double tip_m_s = kNominalSpeed_rpm / 60 * 2 * std::numbers::pi * kRadius_m;
  return 0.5 * density_kg_m3 * tip_m_s * tip_m_s * std::numbers::pi * kRadius_m * kRadius_m;
}

World plan_world(const Settings& settings, const Design& design) {
  Random order(settings.seed, "order"), weather_random(settings.seed, "weather"),
      days(settings.seed, "conditions"), field(settings.seed, "field");
  World world;
  world.blocks = settings.blocks;
  const Weather weather(weather_random, design.hot_weather, design.pressure_swing_Pa, design.warmth_swing_K);
  Rig rig(days, weather, design);
  const std::vector<Visit> visits = plan_visits(settings, design, order);
  double start_s = 0;
  for (std::size_t i = 0; i < visits.size(); ++i) {
    Conditions run;
    run.session = static_cast<int>(i * static_cast<std::size_t>(settings.blocks) / visits.size());
    run.first_of_session = world.runs.empty() || world.runs.back().session != run.session;
    if (run.first_of_session) {
      rig.begin_session();
      start_s = session_start_s(run.session, settings, days);
    }
    run.location = visits[i].location;
    run.repeat = visits[i].repeat;
    place(run);
    rig.meet(run, start_s);
    world.runs.push_back(run);
  }
  if (!settings.separating.empty()) add_separating_sessions(world, settings, rig, days);
  Random switches(settings.seed, "switches");
  switch_about(world, switches);
  lay_baseline(world, design, field);
  return world;
}

}  // namespace tunnelrig::attribution
