// Where a campaign stands: what is recorded, or what comes next.
#pragma once

#include "datasets/campaign.h"

#include <optional>
#include <string>

namespace tunnelrig::live {

enum class Phase { kIdle, kWaiting, kRecording, kFinished };

constexpr const char* name_of(Phase phase) {
  switch (phase) {
    case Phase::kIdle:
      return "idle";
    case Phase::kWaiting:
      return "waiting";
    case Phase::kRecording:
      return "recording";
    case Phase::kFinished:
      return "finished";
  }
  return "";
}

/// A run that is being recorded, was last recorded, or comes next; `run` is empty in the last case.
struct LiveRun {
  std::string run, location, session;
  int repeat = 1;
  RunKind kind = RunKind::kThrust;
  double duration_s = 60;
  std::optional<double> speed_rpm, air_temperature_C;
};

struct Position {
  Phase phase = Phase::kIdle;
  LiveRun run;
  std::string next_location;  // of the plan
};

}  // namespace tunnelrig::live
