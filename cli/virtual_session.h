// The virtual rig as `log` uses it: a calendar for it to live in, and its benches.
#pragma once

#include "daq/run_plan.h"
#include "daq/virtual_rig.h"
#include "datasets/campaign_file.h"

#include <map>
#include <memory>
#include <string>
#include <vector>

namespace tunnelrig::cli {

/// Sessions of the virtual rig are consecutive days from 2026-03-02, runs follow each other every five
/// minutes from 08:00, or a minute after a longer one's end, whatever the time of the wall clock: what it
/// measures is then a function of the seed and of the runs alone.
class VirtualSession {
 public:
  /// A new file is given what the virtual benches measure: calibration points and propeller tests.
  VirtualSession(CampaignFile& file, const CampaignInfo& info, std::uint64_t seed);

  /// The next run of its session.
  VirtualRunRequest request(const PlannedRun& planned, double speed_rpm);

  InstrumentReadings readings(const VirtualRunRequest& request) const { return rig_.readings(request); }
  std::unique_ptr<PacketSource> board(const VirtualRunRequest& request, double pace,
                                      const Faults& faults) const {
    return rig_.board(request, pace, faults);
  }

 private:
  /// From the session's begin to where its next run may begin.
  double& taken_s(const std::string& session);

  VirtualRig rig_;
  std::vector<std::string> sessions_;      // in order of first appearance
  std::map<std::string, double> taken_s_;  // by the runs of each so far
};

}  // namespace tunnelrig::cli
