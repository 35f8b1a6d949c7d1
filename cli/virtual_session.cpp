#include "cli/virtual_session.h"

#include "datasets/raw_store.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace tunnelrig::cli {
namespace {

constexpr double kFirstDay_s = 1772409600;  // 2026-03-02T00:00Z
constexpr double kDay_s = 86400;
constexpr double kMorning_s = 8 * 3600;
constexpr double kRunInterval_s = 300;
constexpr double kPause_s = 60;  // behind a run that leaves less of the interval

double slot_s(double duration_s) { return std::max(kRunInterval_s, duration_s + kPause_s); }

/// As the board counted, in whole seconds, as most plans have them: after a break the calendar goes on as it
/// would have without. 0 where nothing of the run was recorded.
double recorded_s(const CampaignFile& file, const CampaignInfo& info, const std::string& run) {
  const auto raw = raw_run(file, run);
  if (!raw) return 0;
  const auto ledger = ledger_of(file, raw->id);
  const auto frames = static_cast<double>(ledger ? ledger->frames_emitted : raw->frames);
  return std::round(frames / info.daq.sample_rate_hz);
}

}  // namespace

VirtualSession::VirtualSession(CampaignFile& file, const CampaignInfo& info, std::uint64_t seed)
    : rig_(info, {.seed = seed}) {
  if (!file.sheet("calibration")) file.set_sheet("calibration", rig_.calibration_bench());
  if (!file.sheet("propellers")) file.set_sheet("propellers", rig_.propeller_bench());
  for (const Run& run : file.runs()) taken_s(run.session) += slot_s(recorded_s(file, info, run.run));
}

double& VirtualSession::taken_s(const std::string& session) {
  const auto [found, first] = taken_s_.try_emplace(session, 0);
  if (first) sessions_.push_back(session);
  return found->second;
}

VirtualRunRequest VirtualSession::request(const PlannedRun& planned, double speed_rpm) {
  double& taken = taken_s(planned.session);
  const auto day = std::find(sessions_.begin(), sessions_.end(), planned.session) - sessions_.begin();
  const double session_start_s = kFirstDay_s + kDay_s * static_cast<double>(day) + kMorning_s;
  const double start_s = session_start_s + std::exchange(taken, taken + slot_s(planned.duration_s));
  return {.session = planned.session,
          .location = planned.location,
          .repeat = planned.repeat,
          .kind = planned.kind,
          .start_s = start_s,
          .session_start_s = session_start_s,
          .duration_s = planned.duration_s,
          .speed_rpm = speed_rpm};
}

}  // namespace tunnelrig::cli
