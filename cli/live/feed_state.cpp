// What the feed says four times a second: state and alarms.
#include "cli/live/feed.h"
#include "cli/live/run_alarms.h"

#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace tunnelrig::live {
namespace {

using Json = nlohmann::ordered_json;

Json or_null(const std::optional<double>& value) { return value ? Json(*value) : Json(nullptr); }

Json json_of(const std::optional<KnownMean>& mean) {
  if (!mean) return nullptr;
  return {{"mean", mean->mean}, {"u95", or_null(mean->u95)}};
}

Json ledger_json(const Ledger& ledger) {
  return {{"stored", ledger.frames_stored},    {"lost", ledger.frames_lost},
          {"late", ledger.frames_late},        {"duplicate", ledger.frames_duplicate},
          {"corrupt", ledger.packets_corrupt}, {"reboots", ledger.reboots},
          {"silences", ledger.silences}};
}

}  // namespace

bool is_low(const std::filesystem::space_info& disk) {
  return disk.capacity > 0 && static_cast<double>(disk.available) < kDiskLow_B;
}

std::string LiveFeed::state_json(const Shared& now, const Scale& scale) const {
  const Position& position = now.position;
  const Progress& progress = now.progress;
  const auto text_or_null = [](const std::string& text) { return text.empty() ? Json(nullptr) : Json(text); };
  Json json{{"phase", name_of(position.phase)},
            {"run", text_or_null(position.run.run)},
            {"location", position.run.location},
            {"next_location", text_or_null(position.next_location)},
            {"session", position.run.session},
            {"repeat", position.run.repeat},
            {"kind", position.run.kind == RunKind::kTare ? "tare" : "thrust"},
            {"elapsed_s", progress.elapsed_s},
            {"duration_s", position.run.duration_s},
            {"silent", progress.silent},
            {"ledger", ledger_json(progress.ledger)},
            {"ring_high_water", progress.ring_frames ? Json(*progress.ring_frames) : Json(nullptr)},
            {"disk_free_B", disk_.available}};
  const double nominal_hz = info_.daq.sample_rate_hz;
  const auto& clock = progress.clock;
  json["board_clock_ppm"] = clock ? Json(1e6 * (clock->rate_hz / nominal_hz - 1)) : Json(nullptr);
  json["board_clock_ppm_interval"] = clock ? Json(1e6 * clock->rate_interval_hz / nominal_hz) : Json(nullptr);
  json["tare_age_s"] = or_null(tare_age_s(now));
  RunningMeans means;
  if (view_ && view_->run.run == position.run.run)
    means = means_(view_->blocks, scale, info_, view_->run.air_temperature_C);
  json["means"] = Json::array();
  for (int rotor = 0; rotor < info_.rig.rotors; ++rotor) {
    const auto i = static_cast<std::size_t>(rotor);
    const bool known = i < means.rotors.size();
    json["means"].push_back({{"rotor", rotor + 1},
                             {"mean", known ? Json(means.rotors[i].mean) : Json(nullptr)},
                             {"u95", known ? or_null(means.rotors[i].u95) : Json(nullptr)},
                             {"unit", scale.unit()}});
  }
  const bool thrust = position.run.kind == RunKind::kThrust;
  json["c_t"] = thrust ? json_of(means.c_t) : Json(nullptr);
  json["u_percent"] = thrust ? json_of(means.u_percent) : Json(nullptr);
  json["means_note"] = "run only, without calibration";
  json["target"] = {{"c_t_u95", now.target.c_t_u95}, {"u_percent_u95", now.target.u_percent_u95}};
  json["viewers"] = viewers_.count();
  json["display_frames_dropped"] = ring_.dropped() + viewers_.dropped();
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

/// Since the session's last tare: by this process's clock, or by the file's where it was recorded earlier.
std::optional<double> LiveFeed::tare_age_s(const Shared& now) {
  const std::string& session = now.position.run.session;
  if (const auto here = now.tare_ended.find(session); here != now.tare_ended.end())
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - here->second).count();
  const auto stored = now.cells->tares.find(session);
  if (stored == now.cells->tares.end() || stored->second.simulated) return {};
  return utc_seconds() - stored->second.end_s;
}

/// Alarms of the whole rig.
void LiveFeed::check(const Shared& now, const Scale& scale, Time time) {
  const LiveRun& run = now.position.run;
  const bool recording = now.position.phase == Phase::kRecording;
  const Ledger& ledger = now.progress.ledger;
  const std::lock_guard lock(mutex_);
  alarms_.set("disk", 0, is_low(disk_),
              fmt::format("{:.0f} MB left on the disk", static_cast<double>(disk_.available) / 1e6), time);
  const auto tare = now.cells->tares.find(run.session);
  if (tare != now.cells->tares.end() && tare->second.drift_rotor > 0) {
    const double drift_V = tare->second.drift_V;
    const auto channel = static_cast<std::size_t>(tare->second.drift_rotor - 1);
    const double drift_N =
        scale.newtons ? std::abs(drift_V / info_.daq.volts_per_count() * scale.slope[channel]) : 0;
    alarms_.set("tare_drift", tare->second.drift_rotor,
                scale.newtons ? drift_N > kTareDrift_N : std::abs(drift_V) > kTareDrift_V,
                scale.newtons ? fmt::format("its zero moved by {:.3f} N between the last two tares", drift_N)
                              : fmt::format("its zero moved by {:.4f} V between the last two tares", drift_V),
                time);
  }
  alarms_.set("silent", 0, recording && now.progress.silent,
              !now.progress.problem.empty()  ? fmt::format("no frames come: {}", now.progress.problem)
              : now.progress.instead.empty() ? "no frames come from the board"
                                             : fmt::format("no new frames, only {}", now.progress.instead),
              time);
  alarms_.set("loss", 0, recording && ledger.frames_lost > 0,
              fmt::format("{} of {} frames lost in this run", ledger.frames_lost, ledger.frames_emitted),
              time);
  alarms_.set("test_pattern", 0, recording && ledger.frames_test_pattern > 0,
              "the board sends its test pattern, no measurements", time);
  alarms_.set("clipping", 0, recording && ledger.frames_clipped > 0,
              fmt::format("the board flags {} frames of this run as clipped", ledger.frames_clipped), time);
  const double nominal = info_.rig.nominal_speed_rpm;
  const auto off = [&](double rpm) { return std::abs(rpm / nominal - 1) > kSpeedTolerance; };
  const bool thrust = recording && run.kind == RunKind::kThrust;
  const bool seen_off = thrust && shaft_hz_ && off(60 * *shaft_hz_);
  const bool read_off = thrust && run.speed_rpm && off(*run.speed_rpm);
  alarms_.set(
      "speed", 0, seen_off || read_off,
      fmt::format("{:.0f} rev/min {}, set is {:.0f} ± {:.0f}",
                  seen_off ? 60 * *shaft_hz_ : run.speed_rpm.value_or(0),
                  seen_off ? "by the shaft's line" : "by the tachometer", nominal, kSpeedTolerance * nominal),
      time);
  check_channels(now, scale, time);
  if (alarms_.settle(time)) viewers_.tell("alarms", alarms_.json());
}

/// Alarms of the cells, from the last whole second.
void LiveFeed::check_channels(const Shared& now, const Scale& scale, Time time) {
  const bool watching = now.position.phase == Phase::kRecording && view_ && view_->number == now.run_number &&
                        view_->watch.ready();
  for (int rotor = 1; rotor <= info_.rig.rotors; ++rotor) {
    const auto i = static_cast<std::size_t>(rotor - 1);
    const ChannelSecond channel = watching ? view_->watch.channels()[i] : ChannelSecond{.high = 1};
    const double low = scale.value(i, channel.low), high = scale.value(i, channel.high);
    const double most_N = std::max(std::abs(low), std::abs(high));
    alarms_.set("clipping", rotor, watching && channel.clipped > 0,
                fmt::format("{} samples a second at the end of the converter's range", channel.clipped),
                time);
    alarms_.set("stuck", rotor, watching && channel.stuck(), "the channel never changes", time);
    alarms_.set("dead", rotor, watching && channel.dead(), "less noise than a converter has", time);
    alarms_.set("overload", rotor, watching && scale.newtons && most_N > info_.rig.cell_limit_N,
                fmt::format("{:.2f} N, the cell may carry {:.2f} N", most_N, info_.rig.cell_limit_N), time);
  }
}

}  // namespace tunnelrig::live
