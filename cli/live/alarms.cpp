#include "cli/live/alarms.h"

#include "datasets/campaign.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace tunnelrig::live {
namespace {

constexpr std::chrono::seconds kStays{5};

/// What a run's own frames say ends with the run; the disk and the tares do not.
bool is_of_frames(const std::string& kind) { return kind != "disk" && kind != "tare_drift"; }

}  // namespace

void Alarms::set(std::string_view kind, int rotor, bool wrong, const std::string& text, Time now) {
  const std::pair<std::string, int> key(kind, rotor);
  auto found = active_.find(key);
  if (!wrong) {
    if (found != active_.end()) found->second.wrong = false;
    return;
  }
  of_run_[key.first] = true;
  if (found == active_.end()) {
    found = active_.emplace(key, Alarm{.since_utc = format_utc(utc_seconds())}).first;
    changed_ = true;
  }
  Alarm& alarm = found->second;
  changed_ |= alarm.text != text;
  alarm.text = text;
  alarm.seen = now;
  alarm.wrong = true;
}

void Alarms::begin_run() {
  changed_ |= std::erase_if(active_, [](const auto& alarm) { return is_of_frames(alarm.first.first); }) > 0;
  of_run_.clear();
}

bool Alarms::settle(Time now) {
  changed_ |= std::erase_if(active_, [&](const auto& alarm) {
                return !alarm.second.wrong && now - alarm.second.seen > kStays;
              }) > 0;
  return std::exchange(changed_, false);
}

std::string Alarms::json() const {
  nlohmann::ordered_json json{{"active", nlohmann::ordered_json::array()}};
  for (const auto& [key, alarm] : active_) {
    json["active"].push_back({{"kind", key.first},
                              {"rotor", key.second > 0 ? nlohmann::ordered_json(key.second) : nullptr},
                              {"text", alarm.text},
                              {"since_utc", alarm.since_utc}});
  }
  return json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);  // the system's texts
}

std::string Alarms::of_run() const {
  std::string kinds;
  for (const auto& [kind, was] : of_run_) kinds += (kinds.empty() ? "" : ";") + kind;
  return kinds;
}

}  // namespace tunnelrig::live
