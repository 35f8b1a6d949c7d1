#include "analysis/reduction.h"

#include "analysis/air.h"
#include "analysis/conventions.h"
#include "datasets/error.h"
#include "datasets/thesis.h"

#include <cmath>

namespace tunnelrig {
namespace {

constexpr std::array<double, kMaxRotors> kSide = {1, -1, -1,
                                                  1};  // (5.1): right pair 1, 4 minus left pair 2, 3

double required(const Run& run, std::string_view column, std::string_view term) {
  if (const auto value = run.number(column)) return *value;
  throw InputError::at("runs.csv", run.line,
                       "run {} has no {}, which the switched-on term {} needs in every run", run.run, column,
                       term);
}

/// ρ and Ω of a run by the model. Returns why there are none; empty where there are.
std::string set_conditions(const Run& run, const CampaignInfo& info, const ModelTerms& terms,
                           RunCoefficients& result) {
  const auto celsius = run.number("air_temperature_C");
  if (!celsius) return "air_temperature_C was not recorded, so there is no density";
  result.temperature_K = *celsius + kZeroCelsius_K;
  const double pressure_Pa =
      terms.air_pressure ? required(run, "air_pressure_Pa", "air_pressure") : thesis::kPressure_Pa;
  result.density_kg_m3 = terms.air_humidity
                             ? moist_air_density_kg_m3(pressure_Pa, result.temperature_K,
                                                       required(run, "relative_humidity", "air_humidity"))
                             : dry_air_density_kg_m3(pressure_Pa, result.temperature_K);
  result.speed_rpm =
      terms.rotor_speed ? required(run, "speed_rpm", "rotor_speed") : info.rig.nominal_speed_rpm;
  return result.speed_rpm > 0 ? "" : "speed_rpm is 0, so there is no C_T";
}

void read_thrusts_from_volts(const CampaignData& data, const Run& run, const RunStatistics& statistics,
                             const Certificate& certificate, const Tares& tares, RunCoefficients& result) {
  result.from_volts = true;
  result.tare =
      tares.zero_at(run.session, run.start_s + 0.5 * statistics.elapsed_s(data.info.daq.sample_rate_hz));
  for (int rotor = 0; rotor < data.info.rig.rotors; ++rotor) {
    const auto i = static_cast<std::size_t>(rotor);
    const ChannelStatistics& channel = statistics.channels[i];
    const auto zero = result.tare ? std::optional<double>(result.tare->zero_V[i]) : std::nullopt;
    const ForceReading force = certificate.force(rotor + 1, channel.mean_V, zero);
    const double k = certificate.propellers.factor(rotor);
    result.thrust_N[i] = force.force_N / k;
    result.d_zero_N_per_V[i] = force.d_zero_N_per_V / k;
    result.d_gain_N2_per_V[i] = force.d_gain_N2_per_V / k;
    result.d_tare_N_per_V[i] = force.d_tare_N_per_V / k;
    result.thrust_standard_error_N[i] = std::abs(force.d_voltage_N_per_V) * channel.standard_error_V / k;
    result.zero_from_calibration |= force.zero_from_calibration;
    result.extrapolated |= force.extrapolated;
    result.stationary &= channel.stationary();
    result.clipped += channel.clipped;
  }
}

/// Why the means of a run with raw data, thrust or tare, cannot be used; without a reason where they can.
LeftOutRun why_not(const CampaignData& data, const Run& run, const RawRun& raw) {
  if (raw.state != RunState::kComplete) return {run.run, "its recording is partial", false};
  const auto statistics = data.statistics.find(run.run);
  if (statistics == data.statistics.end())
    return {run.run, "no statistics are stored; `reduce --from-raw` computes them"};
  if (statistics->second.hash != raw.hash)
    return {run.run, "its statistics are of other raw data; `reduce --from-raw` computes them anew"};
  if (statistics->second.frames == 1) return {run.run, "it has one frame only"};
  for (int rotor = 0; rotor < data.info.rig.rotors; ++rotor) {
    if (statistics->second.channels[static_cast<std::size_t>(rotor)].stuck())
      return {run.run, fmt::format("channel {} is stuck: it never changes", rotor + 1)};
  }
  return {run.run, ""};
}

/// A tare that is no zero shows in no run: those of its session have another zero without a word.
void leave_out_tares(const CampaignData& data, std::vector<LeftOutRun>& left_out) {
  for (const Run& run : data.runs) {
    const auto raw = data.raw.find(run.run);
    if (run.kind != RunKind::kTare || !run.excluded.empty() || raw == data.raw.end()) continue;
    LeftOutRun tare = why_not(data, run, raw->second);
    if (tare.reason.empty()) continue;
    tare.reason += " (this tare is no zero)";
    left_out.push_back(std::move(tare));
  }
}

}  // namespace

std::vector<std::size_t> recorded_runs(const CampaignData& data, RunKind kind) {
  std::vector<std::size_t> recorded;
  for (std::size_t r = 0; r < data.runs.size(); ++r) {
    const Run& run = data.runs[r];
    const auto raw = data.raw.find(run.run);
    if (run.kind == kind && run.excluded.empty() && raw != data.raw.end() &&
        why_not(data, run, raw->second).reason.empty())
      recorded.push_back(r);
  }
  return recorded;
}

Tares tares_of(const CampaignData& data) {
  std::vector<TareReading> readings;
  for (const std::size_t r : recorded_runs(data, RunKind::kTare)) {
    const Run& run = data.runs[r];
    const RunStatistics& statistics = data.statistics.at(run.run);
    const std::vector<ChannelStatistics>& channels = statistics.channels;
    const double half_s = 0.5 * statistics.elapsed_s(data.info.daq.sample_rate_hz);
    TareReading reading{.session = run.session, .time_s = run.start_s + half_s, .run = run.run};
    for (std::size_t c = 0; c < std::min<std::size_t>(channels.size(), kMaxRotors); ++c) {
      reading.mean_V[c] = channels[c].mean_V;
      reading.standard_error_V[c] = channels[c].standard_error_V;
    }
    readings.push_back(reading);
  }
  return Tares(std::move(readings));
}

std::string ModelTerms::name() const {
  std::string name;
  const auto add = [&name](bool on, std::string_view term) {
    if (on) name += (name.empty() ? "" : "+") + std::string(term);
  };
  add(air_pressure, "air_pressure");
  add(air_humidity, "air_humidity");
  add(rotor_speed, "rotor_speed");
  return name.empty() ? "thesis" : name;
}

ModelTerms terms_from_names(std::string_view names) {
  ModelTerms terms;
  while (!names.empty()) {
    const auto end = names.find_first_of(",+");
    const std::string_view name = names.substr(0, end);
    if (name == "air_pressure")
      terms.air_pressure = true;
    else if (name == "air_humidity")
      terms.air_humidity = true;
    else if (name == "rotor_speed")
      terms.rotor_speed = true;
    else if (name != "thesis")
      throw InputError(fmt::format(
          "--with: '{}' is no term; write air_pressure, air_humidity, rotor_speed or thesis", name));
    names = end == std::string_view::npos ? std::string_view() : names.substr(end + 1);
  }
  return terms;
}

std::array<double, kMaxRotors> c_t_per_thrust(const RunCoefficients& run, const Rig& rig) {
  std::array<double, kMaxRotors> slope{};
  const double reference_N = thesis_reference_thrust_N(run.density_kg_m3, run.speed_rpm, rig);
  for (std::size_t i = 0; i < static_cast<std::size_t>(rig.rotors); ++i) slope[i] = 1 / reference_N;
  return slope;
}

std::array<double, kMaxRotors> u_per_thrust(const RunCoefficients& run) {
  std::array<double, kMaxRotors> slope{};
  if (std::isnan(run.u_percent)) return slope;
  for (std::size_t i = 0; i < slope.size(); ++i) slope[i] = (100 * kSide[i] - run.u_percent) / run.total_N;
  return slope;
}

void set_coefficients(const CampaignInfo& info, RunCoefficients& result) {
  double uneven_N = 0;
  result.total_N = 0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(info.rig.rotors); ++i) {
    result.total_N += result.thrust_N[i];
    uneven_N += kSide[i] * result.thrust_N[i];
  }
  result.c_t =
      result.total_N / thesis_reference_thrust_N(result.density_kg_m3, result.speed_rpm, info.rig);  // (4.18)
  result.u_percent = info.rig.rotors == kMaxRotors ? 100 * uneven_N / result.total_N
                                                   : std::numeric_limits<double>::quiet_NaN();  // (5.1)
  const auto c_t_slope = c_t_per_thrust(result, info.rig);
  const auto u_slope = u_per_thrust(result);
  double c_t_variance = 0, u_variance = 0;
  for (std::size_t i = 0; i < result.thrust_standard_error_N.size(); ++i) {
    c_t_variance += std::pow(c_t_slope[i] * result.thrust_standard_error_N[i], 2);
    u_variance += std::pow(u_slope[i] * result.thrust_standard_error_N[i], 2);
  }
  result.c_t_standard_error = std::sqrt(c_t_variance);
  result.u_standard_error = std::sqrt(u_variance);
}

std::string Reduction::model_name() const {
  if (model.version == 0) return terms.name();
  return fmt::format("version {} ({})", model.version, fmt::join(model.effects, ", "));
}

Reduction reduce_runs(const CampaignData& data, const ModelTerms& terms) {
  Reduction reduction;
  reduction.terms = terms;
  reduction.tares = tares_of(data);
  for (std::size_t r = 0; r < data.runs.size(); ++r) {
    const Run& run = data.runs[r];
    if (!run.excluded.empty()) {
      reduction.left_out.push_back({run.run, fmt::format("excluded: {}", run.excluded), false});
      continue;
    }
    if (run.kind == RunKind::kTare) continue;
    RunCoefficients result;
    result.run = r;
    if (const std::string reason = set_conditions(run, data.info, terms, result); !reason.empty()) {
      reduction.left_out.push_back({run.run, reason});
      continue;
    }
    if (const auto raw = data.raw.find(run.run); raw != data.raw.end()) {
      if (LeftOutRun out = why_not(data, run, raw->second); !out.reason.empty()) {
        reduction.left_out.push_back(std::move(out));
        continue;
      }
      if (!data.certificate)
        throw InputError("there is no calibration yet: `tunnelrig calibrate` comes before this");
      read_thrusts_from_volts(data, run, data.statistics.at(run.run), *data.certificate, reduction.tares,
                              result);
    } else if (run.thrust_N[0]) {
      for (std::size_t i = 0; i < static_cast<std::size_t>(data.info.rig.rotors); ++i)
        result.thrust_N[i] = run.thrust_N[i].value_or(0);
    } else {
      reduction.left_out.push_back({run.run, "it has no raw data and no thrusts"});
      continue;
    }
    set_coefficients(data.info, result);
    if (!(result.total_N > 0)) {
      reduction.left_out.push_back(
          {run.run, fmt::format("its total thrust is {:.3g} N: were the motors running?", result.total_N)});
      continue;
    }
    reduction.runs.push_back(result);
  }
  if (reduction.runs.empty()) {
    throw InputError(reduction.left_out.empty()
                         ? "the campaign holds no thrust run"
                         : fmt::format("no run can be reduced; run {}: {}", reduction.left_out[0].run,
                                       reduction.left_out[0].reason));
  }
  leave_out_tares(data, reduction.left_out);
  return reduction;
}

}  // namespace tunnelrig
