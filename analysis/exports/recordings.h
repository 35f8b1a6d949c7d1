// The time series of recordings: raw samples, frame numbers, calibrated thrusts. Private to exports/.
#pragma once

#include "analysis/campaign_data.h"
#include "analysis/exports/export_campaign.h"
#include "analysis/exports/writer.h"
#include "datasets/raw_store.h"

#include <map>
#include <optional>
#include <string>
#include <vector>

namespace tunnelrig::exports {

/// thrust of rotor i = offset_N[i] + slope_N[i] · sample of channel i: the calibration in force, the zero of
/// the session's tares at the middle of the run (the calibration's without tares), and the propeller's
/// factor, as in `reduce` by the thesis's model. Adopted effects are not in it.
struct ThrustLine {
  std::vector<double> offset_N, slope_N;  // one per rotor
};

/// A recording and what its series are made from.
struct RecordingSource {
  RawRun raw;
  Recording description;
  std::optional<ThrustLine> thrust;
};

/// All recordings that can be exported; the rest is named in `absent`.
std::vector<RecordingSource> recording_sources(const CampaignFile& file, const CampaignData& data,
                                               const Parts& parts,
                                               const std::map<std::string, std::string>& keys,
                                               std::vector<Absent>& absent);

/// Reads each recording once and hands it to the writer block by block; only a MATLAB file needs it whole.
void stream_recordings(const CampaignFile& file, const std::vector<RecordingSource>& sources, Writer& writer,
                       const Progress& progress);

}  // namespace tunnelrig::exports
