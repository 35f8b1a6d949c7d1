#include "cli/virtual_session.h"

#include <algorithm>

namespace tunnelrig::cli {
namespace {

constexpr double kFirstDay_s = 1772409600;  // 2026-03-02T00:00Z
constexpr double kDay_s = 86400;
constexpr double kMorning_s = 8 * 3600;
constexpr double kRunInterval_s = 300;

}  // namespace

VirtualSession::VirtualSession(CampaignFile& file, const CampaignInfo& info, std::uint64_t seed)
    : rig_(info, {.seed = seed}) {
  if (!file.sheet("calibration")) file.set_sheet("calibration", rig_.calibration_bench());
  if (!file.sheet("propellers")) file.set_sheet("propellers", rig_.propeller_bench());
  for (const Run& run : file.runs()) {
    if (runs_[run.session]++ == 0) sessions_.push_back(run.session);
  }
}

VirtualRunRequest VirtualSession::request(const PlannedRun& planned, double speed_rpm) {
  const int position = runs_[planned.session]++;
  if (position == 0) sessions_.push_back(planned.session);
  const auto day = std::find(sessions_.begin(), sessions_.end(), planned.session) - sessions_.begin();
  const double session_start_s = kFirstDay_s + kDay_s * static_cast<double>(day) + kMorning_s;
  return {.session = planned.session,
          .location = planned.location,
          .repeat = planned.repeat,
          .kind = planned.kind,
          .start_s = session_start_s + kRunInterval_s * position,
          .session_start_s = session_start_s,
          .duration_s = planned.duration_s,
          .speed_rpm = speed_rpm};
}

}  // namespace tunnelrig::cli
