#include "daq/virtual_rig.h"

#include "daq/virtual_board.h"
#include "daq/virtual_weather.h"
#include "datasets/error.h"
#include "datasets/locations.h"
#include "datasets/published_field.h"
#include "datasets/thesis.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace tunnelrig {
namespace {

constexpr double kTwoPi = 2 * std::numbers::pi;

// What a rig is built of, and how alike its parts are (σ): docs/virtual-rig.md. Unlike VirtualRigSettings,
// nobody asks for another.

// Cells of 1 kg behind amplifiers: 9.8 N gives 2.7 V of the converter's 3.3 V.
constexpr double kZero_V = 0.34, kZeroScatter_V = 0.02;
constexpr double kGain_V_per_N = 0.242, kGainScatter = 0.01;

// The bench of cells goes over what the thesis calibrated, 0.5 to 1 kg; that of propellers has a rotor's
// thrust at hover, 0.75 kg.
constexpr double kLightest_N = 4.9, kHeaviest_N = 9.8;
constexpr int kForcesPerCell = 10;
constexpr double kHover_N = 7.4, kPropellerBenchScatter = 0.0015;
constexpr int kTestsPerPropeller = 4;

// Instruments on the wall (Pa; of relative humidity) and the supply, the thesis's 15 V.
constexpr double kBarometer_Pa = 20, kHygrometer = 0.01;
constexpr double kSupply_V = 15, kSupplyScatter_V = 0.01;

constexpr double kMotorsApart_Hz = 0.02;  // one from another at the same set speed: 1.2 rev/min

// Turbulence relative to the tunnel's, whose walls send a rotor's own wake back: the fewer, the calmer.
constexpr double kOpenSpaceTurbulence = 0.5, kGroundTurbulence = 0.7, kCeilingTurbulence = 0.6;

/// What is drawn for different things from one seed must not hang together: each has its own stream, named.
std::mt19937_64 stream(std::uint64_t seed, const std::string& name) {
  std::uint64_t hash = 0xcbf29ce484222325u ^ seed;  // FNV-1a
  for (const char c : name) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
  std::seed_seq sequence{static_cast<std::uint32_t>(hash), static_cast<std::uint32_t>(hash >> 32)};
  return std::mt19937_64(sequence);
}

double normal(std::mt19937_64& engine, double deviation) {
  return deviation * std::normal_distribution<double>()(engine);
}

/// C_T and uneven thrust at a location; throws where the rig cannot go.
struct Place {
  double c_t = 0;
  double uneven = 0;
  double turbulence = 1;  // relative to the tunnel's
};

Place place_of(const std::string& location) {
  if (const auto point = grid_point(location)) {
    return {thesis::kCtTunnelOrigin * (1 + published_thrust_change(point->y_norm, point->z_norm)),
            published_uneven_thrust(point->y_norm, point->z_norm)};
  }
  if (location == "OS") return {thesis::kCtOpenSpace, 0, kOpenSpaceTurbulence};
  if (const auto distance = distance_of(location, "GND"); distance && *distance > 0) {
    return {thesis::kCtOpenSpace * published_ground_ratio(*distance), 0, kGroundTurbulence};
  }
  if (const auto distance = distance_of(location, "CEIL"); distance && *distance > 0) {
    return {thesis::kCtOpenSpace * published_ceiling_ratio(*distance), 0, kCeilingTurbulence};
  }
  throw InputError(fmt::format(
      "the virtual rig does not know the location '{}' (H0V-3 to H5V3, OT, OS, GND1.25, CEIL0.75)",
      location));
}

/// The published coefficients are as the thesis reduced them: dry air at 101325 Pa. In this climate that and
/// the truth agree.
double density_scale() {
  const Weather reference{.air_temperature_C = 21, .air_pressure_Pa = 101325, .relative_humidity = 0.5};
  const double dry = thesis::kPressure_Pa / (thesis::kGasConstant_J_kgK * (21 + 273.15));
  return dry / true_air_density(reference);
}

/// What is drawn for one run.
struct Conditions {
  Weather weather;
  double speed_rpm = 0;
  std::array<double, kMaxRotors> thrust_N{};
  std::array<double, kMaxRotors> zero_shift_V{};
  double turbulence = 1;
};

std::string key_of(const VirtualRunRequest& run) {
  return fmt::format("{}|{}|{}|{}", run.session, run.location, run.repeat, run.start_s);
}

Conditions conditions_of(const VirtualRunRequest& run, const CampaignInfo& campaign,
                         const VirtualRigSettings& settings,
                         const std::array<double, kMaxRotors>& propeller_factor) {
  Conditions conditions;
  conditions.weather = weather_at(run.start_s, settings.seed);
  std::mt19937_64 session = stream(settings.seed, "session " + run.session);
  std::mt19937_64 engine = stream(settings.seed, "run " + key_of(run));
  const double session_factor = 1 + normal(session, settings.thrust_session);
  const double hours = (run.start_s - run.session_start_s) / 3600;
  for (double& zero : conditions.zero_shift_V) {
    zero = normal(session, settings.zero_session_V) + normal(session, settings.zero_drift_V_h) * hours;
  }
  if (run.kind == RunKind::kTare) return conditions;

  const Place place = place_of(run.location);
  conditions.turbulence = place.turbulence;
  conditions.speed_rpm = run.speed_rpm + normal(engine, settings.speed_run_rpm);
  const double omega = kTwoPi * conditions.speed_rpm / 60;
  const double dynamic = 0.5 * true_air_density(conditions.weather) * density_scale() * omega * omega *
                         campaign.rig.propeller_radius_m * campaign.rig.propeller_radius_m *
                         campaign.rig.rotor_area_m2;
  const double total_N = place.c_t * dynamic * session_factor * (1 + normal(engine, settings.thrust_run));
  const auto shares = rotor_shares(place.uneven);
  for (std::size_t i = 0; i < shares.size(); ++i) {
    conditions.thrust_N[i] =
        total_N * shares[i] * propeller_factor[i] * (1 + normal(engine, settings.thrust_rotor));
  }
  return conditions;
}

/// The analogue side of one channel: thrust with turbulence and vibration, cell, amplifier.
class Channel {
 public:
  Channel(double zero_V, double gain_V_per_N, double thrust_N, double shaft_hz, double turbulence,
          const VirtualRigSettings& settings, double rate_hz, std::mt19937_64& engine)
      : mean_V_(zero_V + gain_V_per_N * thrust_N),
        turning_(thrust_N > 0),
        vibration_shaft_V_(settings.vibration_shaft_N * gain_V_per_N),
        vibration_blade_V_(settings.vibration_blade_N * gain_V_per_N),
        turn_(kTwoPi * shaft_hz / rate_hz),
        phase_(std::uniform_real_distribution<double>(0, kTwoPi)(engine)),
        decay_(std::exp(-1 / (settings.turbulence_s * rate_hz))) {
    const double turbulence_V = settings.turbulence * turbulence * thrust_N * gain_V_per_N;
    kick_V_ = turbulence_V * std::sqrt(1 - decay_ * decay_);
    noise_V_ = settings.amplifier_noise_V;
    gust_V_ = turbulence_V * std::normal_distribution<double>()(engine);
  }

  double next_V(std::mt19937_64& engine, std::normal_distribution<double>& unit) {
    double volts = mean_V_ + noise_V_ * unit(engine);
    if (!turning_) return volts;
    gust_V_ = decay_ * gust_V_ + kick_V_ * unit(engine);
    phase_ += turn_;
    if (phase_ > kTwoPi) phase_ -= kTwoPi;
    const double s = std::sin(phase_);
    // sin 2φ from sin φ and cos φ: the blade-pass line of a two-bladed propeller
    const double blade = 2 * s * std::cos(phase_);
    volts += gust_V_ + vibration_shaft_V_ * s + vibration_blade_V_ * blade;
    return volts;
  }

 private:
  double mean_V_;
  bool turning_;
  double vibration_shaft_V_, vibration_blade_V_;
  double turn_, phase_;
  double decay_, kick_V_ = 0, gust_V_ = 0, noise_V_ = 0;
};

/// Four channels behind one converter.
class Sampler {
 public:
  Sampler(std::vector<Channel> channels, const Daq& daq, std::mt19937_64 engine)
      : channels_(std::move(channels)),
        counts_per_volt_(1 / daq.volts_per_count()),
        highest_(daq.highest_count()),
        engine_(engine) {}

  trw_frame operator()() {
    trw_frame frame{};
    for (std::size_t c = 0; c < channels_.size(); ++c) {
      const double counts = std::floor(channels_[c].next_V(engine_, unit_) * counts_per_volt_ + 0.5);
      frame.sample[c] = static_cast<std::int16_t>(std::clamp(counts, 0.0, static_cast<double>(highest_)));
      if (frame.sample[c] == 0 || frame.sample[c] == highest_) {
        frame.status = static_cast<std::uint16_t>(frame.status | (1u << c));
      }
    }
    return frame;
  }

 private:
  std::vector<Channel> channels_;
  double counts_per_volt_;
  int highest_;
  std::mt19937_64 engine_;
  std::normal_distribution<double> unit_;
};

std::string cell_text(double value, int digits) { return fmt::format("{:.{}f}", value, digits); }

}  // namespace

VirtualRig::VirtualRig(const CampaignInfo& campaign, const VirtualRigSettings& settings)
    : campaign_(campaign), settings_(settings) {
  if (campaign.rig.rotors != kMaxRotors)
    throw InputError("the virtual rig has four rotors; this campaign says otherwise");
  std::mt19937_64 engine = stream(settings.seed, "hardware");
  double sum = 0;
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    cells_[i] = {.zero_V = kZero_V + normal(engine, kZeroScatter_V),
                 .gain_V_per_N = kGain_V_per_N * (1 + normal(engine, kGainScatter))};
    const double direction =
        i < 2 ? -settings.propeller_direction : settings.propeller_direction;  // 1, 2 CCW
    propeller_factor_[i] = 1 + direction + normal(engine, settings.propeller_within);
    sum += propeller_factor_[i];
  }
  for (double& factor : propeller_factor_) factor *= kMaxRotors / sum;
}

Sheet VirtualRig::calibration_bench() const {
  std::mt19937_64 engine = stream(settings_.seed, "calibration bench");
  std::uniform_real_distribution<double> force(kLightest_N, kHeaviest_N);
  Sheet sheet{.file = "calibration.csv",
              .columns = {"cell", "sequence", "applied_force_N", "voltage_V", "air_temperature_C"},
              .rows = {}};
  for (std::size_t cell = 0; cell < cells_.size(); ++cell) {
    for (int point = 1; point <= kForcesPerCell; ++point) {
      const double true_N = force(engine);
      const double volts = cells_[cell].zero_V + cells_[cell].gain_V_per_N * true_N +
                           normal(engine, settings_.amplifier_noise_V);
      const double gauge_N = true_N + normal(engine, settings_.gauge_N);
      sheet.rows.push_back({{fmt::format("{}", cell + 1), fmt::format("{}", point), cell_text(gauge_N, 4),
                             cell_text(volts, 6), "21.0"},
                            0});
    }
  }
  return sheet;
}

Sheet VirtualRig::propeller_bench() const {
  std::mt19937_64 engine = stream(settings_.seed, "propeller bench");
  Sheet sheet{
      .file = "propellers.csv", .columns = {"propeller", "rotor", "direction", "thrust_N"}, .rows = {}};
  for (std::size_t i = 0; i < propeller_factor_.size(); ++i) {
    for (int repeat = 0; repeat < kTestsPerPropeller; ++repeat) {
      const double thrust_N = kHover_N * propeller_factor_[i] * (1 + normal(engine, kPropellerBenchScatter));
      sheet.rows.push_back({{fmt::format("HQ12x6-{}", i + 1), fmt::format("{}", i + 1), i < 2 ? "CCW" : "CW",
                             cell_text(thrust_N, 4)},
                            0});
    }
  }
  return sheet;
}

InstrumentReadings VirtualRig::readings(const VirtualRunRequest& run) const {
  const Conditions conditions = conditions_of(run, campaign_, settings_, propeller_factor_);
  std::mt19937_64 engine = stream(settings_.seed, "instruments " + key_of(run));
  InstrumentReadings readings;
  readings.speed_rpm =
      run.kind == RunKind::kTare ? 0 : conditions.speed_rpm + normal(engine, settings_.tachometer_rpm);
  readings.air_temperature_C = conditions.weather.air_temperature_C + normal(engine, settings_.thermometer_K);
  readings.air_pressure_Pa = conditions.weather.air_pressure_Pa + normal(engine, kBarometer_Pa);
  readings.relative_humidity =
      std::clamp(conditions.weather.relative_humidity + normal(engine, kHygrometer), 0.0, 1.0);
  readings.supply_voltage_V = kSupply_V + normal(engine, kSupplyScatter_V);
  return readings;
}

std::unique_ptr<PacketSource> VirtualRig::board(const VirtualRunRequest& run, double pace,
                                                const Faults& faults) const {
  const Conditions conditions = conditions_of(run, campaign_, settings_, propeller_factor_);
  const double rate_hz = campaign_.daq.sample_rate_hz;
  std::mt19937_64 engine = stream(settings_.seed, "signal " + key_of(run));
  std::vector<Channel> channels;
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    // Four motors are never exactly alike; the tachometer reads their mean.
    const double shaft_hz = conditions.speed_rpm / 60 + normal(engine, kMotorsApart_Hz);
    channels.emplace_back(cells_[i].zero_V + conditions.zero_shift_V[i], cells_[i].gain_V_per_N,
                          conditions.thrust_N[i], shaft_hz, conditions.turbulence, settings_, rate_hz,
                          engine);
  }
  VirtualBoardSettings board{.frame_rate_hz = rate_hz, .pace = pace, .seed = engine(), .faults = faults};
  board.boot_id = static_cast<std::uint32_t>(engine());
  board.first_sequence =
      static_cast<std::uint64_t>(std::max(0.0, run.start_s - run.session_start_s) * rate_hz);
  return std::make_unique<VirtualBoard>(board, Sampler(std::move(channels), campaign_.daq, engine));
}

}  // namespace tunnelrig
