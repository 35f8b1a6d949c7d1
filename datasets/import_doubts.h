// What an import takes as it stands and a person had better look at.
#pragma once

#include "datasets/campaign.h"
#include "datasets/raw_data.h"
#include "datasets/run_statistics.h"

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace tunnelrig {

/// A sentence each, naming file and line: keys of campaign.toml that nothing reads, columns that are ours but
/// for capitals or have no name, columns of the user's that one text makes a label, sessions in another unit
/// (unit_doubts.h), thrusts that no rotor of this size gives, a location at two places or off the grid, two
/// runs of one array, sessions of more than a day, a sensor that seems stuck.
std::vector<std::string> import_doubts(const CampaignInfo& info, const Sheet& runs_sheet,
                                       const std::vector<Run>& runs);

/// Recordings of floating point, which are volts by the format: looks whether the converter can have read
/// them. One sentence says it for all, with the first run.
class VoltDoubt {
 public:
  explicit VoltDoubt(const CampaignInfo& info) : info_(info) {}

  void look_at(const Run& run, const RawFormat& format, const RunStatistics& statistics);
  std::vector<std::string> doubts() const;

 private:
  const CampaignInfo& info_;
  std::string first_;
  std::size_t runs_ = 0;
};

/// Runs that begin while another is recorded, by its frames: a sampling rate in kHz, or times that are not.
class OverlapDoubt {
 public:
  explicit OverlapDoubt(const CampaignInfo& info) : info_(info) {}

  void look_at(const Run& run, const RunStatistics& statistics, std::span<const Gap> gaps);
  std::vector<std::string> doubts() const;

 private:
  struct Recording {
    std::string run;
    int line;
    double start_s, end_s;
  };

  const CampaignInfo& info_;
  std::vector<Recording> recordings_;
};

/// Tares with a channel that never changes, which are no zeros. Such a thrust run is refused; a tare that was
/// lost need not hold up the others.
class StuckTareDoubt {
 public:
  explicit StuckTareDoubt(const CampaignInfo& info) : info_(info) {}

  void look_at(const Run& run, const RunStatistics& statistics);
  std::vector<std::string> doubts() const;

 private:
  const CampaignInfo& info_;
  std::string first_;
  std::size_t tares_ = 0;
};

}  // namespace tunnelrig
