// Reads the campaign file for the pages, beside the recorder and after it.
#pragma once

#include "cli/live/campaign_json.h"
#include "cli/live/feed.h"

#include <condition_variable>
#include <filesystem>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace tunnelrig::live {

struct BookSettings {
  std::filesystem::path campaign;
  std::vector<PlannedRun> plan;
  bool follow = false;  // another process may be recording (`serve`): look every second
};

/// Tells the pages how the campaign stands, and the feed what calibration and tares say, whenever asked to,
/// and by itself where another process changes the file. Reduces and fits maps on its own thread, of the
/// lowest priority, with a connection of its own that only reads.
class Book {
 public:
  Book(BookSettings settings, Viewers& viewers, LiveFeed& feed);
  ~Book();
  Book(const Book&) = delete;
  Book& operator=(const Book&) = delete;

  /// A run began or ended, or an edit was made: look again soon.
  void look();

 private:
  void work();
  bool changed(CampaignFile& file);
  void read(CampaignFile& file);
  void read_losses(CampaignFile& file, const CampaignData& data);
  void follow(CampaignFile& file, const CampaignData& data);

  BookSettings settings_;
  Viewers& viewers_;
  LiveFeed& feed_;

  std::mutex mutex_;
  std::condition_variable wake_;
  bool asked_ = true, stopping_ = false;

  // the book's own thread only
  std::map<std::string, std::uint64_t> lost_;  // of runs that are finished
  std::string maps_ = "null", maps_of_;        // and what they were made of
  std::string maps_reason_ = "no run has been recorded yet";
  std::int64_t version_ = -1, certificate_ = -1;
  std::thread thread_;
};

/// What a campaign knows of its cells: the certificate in force, and the last tare of every session.
CellKnowledge cells_of(const CampaignData& data);

}  // namespace tunnelrig::live
