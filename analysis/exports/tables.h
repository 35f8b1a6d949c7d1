// The tables of an export, by what they are made from. Private to exports/.
#pragma once

#include "analysis/campaign_data.h"
#include "analysis/exports/contents.h"
#include "analysis/location_summary.h"
#include "analysis/maps/disturbance_map.h"
#include "analysis/model/model_store.h"
#include "datasets/raw_store.h"

#include <map>
#include <string>
#include <vector>

namespace tunnelrig::exports {

/// The names of recordings in an export, by run: their own where every format takes it, else made from it,
/// and different even where capitals are not told apart.
std::map<std::string, std::string> recording_keys(const std::vector<RawRun>& raw);

/// One row: rig, tunnel and electronics of campaign.toml.
Table campaign_table(const CampaignInfo& info);

/// runs.csv, typed, with every column that it has.
Table runs_table(const std::vector<Run>& runs, const std::map<std::string, std::string>& keys);

/// What was recorded of each run, with its loss ledger.
Table recordings_table(const CampaignFile& file, const std::vector<RawRun>& raw,
                       const std::map<std::string, std::string>& keys, const Daq& daq);

/// Where frames are missing, recording by recording.
Table lost_frames_table(const CampaignFile& file, const std::vector<RawRun>& raw,
                        const std::map<std::string, std::string>& keys);

/// Means, errors and drift of every channel of every recording, volts.
Table channel_statistics_table(const CampaignData& data);

std::vector<Table> coefficient_tables(const CampaignData& data, const Reduction& reduction,
                                      const Summary& summary);
ArrayGroup covariance_group(const Summary& summary);

std::vector<Table> calibration_tables(const Certificate& certificate);

Table map_locations_table(const DisturbanceMap& map);
ArrayGroup map_group(const DisturbanceMap& map);

std::vector<Table> model_tables(const std::vector<StoredModel>& models);
ArrayGroup model_covariance_group(const std::vector<StoredModel>& models);

/// Every document that was derived, without its text.
Table documents_table(const CampaignFile& file);

/// campaign.toml, the newest document of each kind, and every version of the model.
std::vector<Attachment> documents_in_force(const CampaignFile& file);

}  // namespace tunnelrig::exports
