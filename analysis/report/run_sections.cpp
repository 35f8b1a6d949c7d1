// What is known of every run: coefficients, health, zeros.
#include "analysis/report/sections.h"
#include "analysis/spectrum.h"
#include "datasets/locations.h"

#include <algorithm>
#include <array>

namespace tunnelrig::report {
namespace {

constexpr std::array kSeverities = {"ok", "note", "problem"};  // as the doctor says them

/// The drift that is the least credible as noise, over its standard error.
double worst_drift(const RunStatistics& statistics) {
  double worst = 0;
  for (const ChannelStatistics& channel : statistics.channels)
    worst = std::abs(channel.drift_z) > std::abs(worst) ? channel.drift_z : worst;
  return worst;
}

std::uint64_t clipped_samples(const RunStatistics& statistics) {
  std::uint64_t clipped = 0;
  for (const ChannelStatistics& channel : statistics.channels) clipped += channel.clipped;
  return clipped;
}

Json shaft_rpm(const RunStatistics& statistics) {
  const auto shaft_hz = middle_shaft_hz(statistics);
  return shaft_hz ? rounded(60 * *shaft_hz, 2) : Json(nullptr);
}

void add_statistics(const Material& material, const Run& run, Json& columns) {
  const auto found = material.data.statistics.find(run.run);
  const bool known = found != material.data.statistics.end();
  columns["samples"].push_back(known ? Json(found->second.frames * found->second.channels.size())
                                     : Json(nullptr));
  columns["clipped"].push_back(known ? Json(clipped_samples(found->second)) : Json(nullptr));
  columns["drift_z"].push_back(known ? rounded(worst_drift(found->second), 2) : Json(nullptr));
  columns["shaft_rpm"].push_back(known && run.kind == RunKind::kThrust ? shaft_rpm(found->second)
                                                                       : Json(nullptr));
}

void add_raw_data(const Material& material, std::size_t r, Json& columns) {
  const auto raw = material.data.raw.find(material.data.runs[r].run);
  const bool known = raw != material.data.raw.end();
  columns["state"].push_back(known ? Json(name_of(raw->second.state)) : Json(nullptr));
  columns["hash"].push_back(known ? Json(raw->second.hash) : Json(nullptr));
  columns["frames"].push_back(known ? Json(material.frames[r].emitted) : Json(nullptr));
  columns["lost"].push_back(known ? Json(material.frames[r].lost) : Json(nullptr));
}

}  // namespace

Json runs_section(const Material& material) {
  Json columns;
  for (std::size_t r = 0; r < material.data.runs.size(); ++r) {
    const Run& run = material.data.runs[r];
    columns["run"].push_back(run.run);
    columns["location"].push_back(canonical_location(run.location));
    columns["session"].push_back(run.session);
    columns["start_s"].push_back(rounded(run.start_s, 3));
    columns["tare"].push_back(run.kind == RunKind::kTare ? 1 : 0);
    columns["speed_rpm"].push_back(maybe(run.number("speed_rpm")));
    columns["c_t"].push_back(nullptr);
    columns["u_percent"].push_back(nullptr);
    add_statistics(material, run, columns);
    add_raw_data(material, r, columns);
  }
  if (!material.reduction) return columns;
  for (const RunCoefficients& reduced : material.reduction->runs) {
    columns["c_t"][reduced.run] = maybe(reduced.c_t);
    columns["u_percent"][reduced.run] = maybe(reduced.u_percent);
  }
  return columns;
}

Json health_section(const Material& material) {
  if (material.data.statistics.empty()) {
    return absent(
        "The runs give thrusts, not raw data, so there are no channels whose drift, clipping and losses "
        "could be looked at.");
  }
  return Json::object();
}

Json tares_section(const Material& material) {
  Json readings = Json::array();
  const auto& certificate = material.data.certificate;
  for (const std::size_t tare : recorded_runs(material.data, RunKind::kTare)) {
    const Run& run = material.data.runs[tare];
    Json reading{{"run", run.run}, {"session", run.session}, {"start_s", run.start_s}};
    for (int rotor = 0; rotor < material.data.info.rig.rotors; ++rotor) {
      const ChannelStatistics& channel =
          material.data.statistics.at(run.run).channels[static_cast<std::size_t>(rotor)];
      reading["mean_V"].push_back(channel.mean_V);
      reading["standard_error_V"].push_back(channel.standard_error_V);
    }
    readings.push_back(std::move(reading));
  }
  if (material.data.raw.empty()) return absent("The runs give thrusts, not voltages, so there are no zeros.");
  if (readings.empty()) {
    return absent(
        "No session has a tare (a run with motors stopped); the zero of every run is the calibration's, "
        "extrapolated.");
  }
  Json json{{"readings", std::move(readings)}, {"gain_V_per_N", nullptr}};
  for (int rotor = 0; certificate && rotor < material.data.info.rig.rotors; ++rotor)
    json["gain_V_per_N"].push_back(certificate->cells[static_cast<std::size_t>(rotor)].gain_V_per_N);
  return json;
}

Json findings_section(const Material& material) {
  Json json = Json::array();
  for (const Finding& finding : material.findings) {
    json.push_back({{"severity", kSeverities[static_cast<std::size_t>(finding.severity)]},
                    {"check", finding.check},
                    {"found", finding.found},
                    {"advice", finding.advice}});
  }
  return json;
}

}  // namespace tunnelrig::report
