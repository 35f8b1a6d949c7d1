// The seam through which what is computed of raw data while it passes gets into the store.
#pragma once

#include "datasets/campaign.h"
#include "datasets/raw_store.h"
#include "datasets/run_statistics.h"

#include <functional>
#include <memory>
#include <string>

namespace tunnelrig {

/// Takes a run's frames and gaps in the order of time and sums them up. analysis/ has the one implementation;
/// datasets/ and daq/ only carry it along.
class RunSummarizer : public FrameSink {
 public:
  /// `hash` is the hash of the raw data that was passed in.
  virtual RunStatistics finish(const std::string& hash) = 0;
};

using SummarizerFactory =
    std::function<std::unique_ptr<RunSummarizer>(const CampaignInfo&, const RawFormat&)>;

}  // namespace tunnelrig
