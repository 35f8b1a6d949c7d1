// What is wrong right now, and what was wrong during the run under way.
#pragma once

#include <chrono>
#include <map>
#include <string>
#include <string_view>
#include <utility>

namespace tunnelrig::live {

/// Alarms by kind ("clipping", "stuck", "dead", "overload", "speed", "tare_drift", "loss", "disk", "silent",
/// "test_pattern", "display") and rotor (0: of the whole rig). One that comes and goes stays for five
/// seconds, so that it can be read.
class Alarms {
 public:
  using Time = std::chrono::steady_clock::time_point;

  /// Begins or refreshes an alarm where `wrong`; lets it end otherwise.
  void set(std::string_view kind, int rotor, bool wrong, const std::string& text, Time now);

  /// A run begins: what the last one's frames said is past.
  void begin_run();

  /// Ends what has not been refreshed for long; true where the active alarms have changed since the last
  /// call.
  bool settle(Time now);

  std::string json() const;    // {"active": […]}
  std::string of_run() const;  // kinds since begin_run, "clipping;loss"

 private:
  struct Alarm {
    std::string text, since_utc;
    Time seen{};
    bool wrong = false;
  };

  std::map<std::pair<std::string, int>, Alarm> active_;
  std::map<std::string, bool, std::less<>> of_run_;
  bool changed_ = true;
};

}  // namespace tunnelrig::live
