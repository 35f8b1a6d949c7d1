// When a source counts as silent, and when it is given up. Private to daq/.
#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>

namespace tunnelrig {

/// Notices that no new frame comes, by the source's own clock (the virtual rig's runs faster than ours).
class Watchdog {
 public:
  enum class Verdict { kFine, kBecameSilent, kStillSilent, kGiveUp };

  Watchdog(double silence_s, double give_up_s) : silence_s_(silence_s), give_up_s_(give_up_s) {}

  /// A slow board is not a silent one: three of its packets.
  Verdict look(std::uint64_t frames, double time_s, double packet_s) {
    const double silence_s = std::max(silence_s_, 3 * packet_s);
    const double since_last_look_s = time_s - std::exchange(looked_s_, time_s);
    if (!started_ || frames != frames_) {
      started_ = true;
      silent_ = false;
      patience_ = 1;
      frames_ = frames;
      since_s_ = time_s;
      next_alarm_s_ = time_s + silence_s;
      return Verdict::kFine;
    }
    // A computer that slept has not looked: of that time no more counts than is silence anyhow.
    if (const double asleep_s = since_last_look_s - silence_s; asleep_s > 0) {
      since_s_ += asleep_s;
      next_alarm_s_ += asleep_s;
    }
    if (time_s - since_s_ >= give_up_s_) return Verdict::kGiveUp;
    if (time_s < next_alarm_s_) return Verdict::kFine;
    patience_ = std::min(2 * patience_, kMostPatience);
    next_alarm_s_ = time_s + patience_ * silence_s;
    return std::exchange(silent_, true) ? Verdict::kStillSilent : Verdict::kBecameSilent;
  }

  bool silent() const { return silent_; }

 private:
  // A board that starts anew when it is opened must come to its first packet before it is opened again.
  static constexpr double kMostPatience = 4;

  double silence_s_, give_up_s_, patience_ = 1;
  bool started_ = false, silent_ = false;
  std::uint64_t frames_ = 0;
  double since_s_ = 0, next_alarm_s_ = 0, looked_s_ = 0;
};

}  // namespace tunnelrig
