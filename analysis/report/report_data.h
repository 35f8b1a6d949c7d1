// A campaign file as one JSON document: everything that the report's page shows (docs/report.md).
#pragma once

#include "analysis/model/model_store.h"
#include "datasets/campaign_file.h"

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

namespace tunnelrig {

struct ReportSettings {
  std::string db;  // the campaign file as the user named it, for the commands that the page names
  std::string program_version;  // of the provenance, as the two below
  std::string arguments;
  std::string created_utc;
  ModelChoice model;
  std::string flights;  // the file of `tunnelrig fly` that the page is to show; empty: none
};

/// A section that a campaign has no data for, with the sentence that stands in its place.
struct AbsentSection {
  std::string section, reason;
};

struct ReportData {
  std::string json;  // "tunnelrig-report/1"
  std::vector<AbsentSection> absent;
};

/// Gathers all sections of a campaign, or of a table of observations. What cannot be had is an absent
/// section; a file with nothing to report at all throws InputError. Reads every blob of raw data, as
/// `examine` does; `progress` is called with done and total runs.
ReportData report_data(const CampaignFile& file, const ReportSettings& settings,
                       const std::function<void(std::size_t, std::size_t)>& progress = {});

}  // namespace tunnelrig
