// A campaign file as it stands at one instant, while somebody records into it.
#pragma once

#include "datasets/campaign_file.h"

namespace tunnelrig {

/// While it lives, everything that is read of `file` is of the instant of the first reading: a run under way
/// has the frames, gaps and ledger of one commit. Recorders are not held up. For a call, not for a page: the
/// file's journal is not folded back meanwhile. `file` must outlive it and have no transaction open.
class Snapshot {
 public:
  explicit Snapshot(const CampaignFile& file);
  ~Snapshot();
  Snapshot(const Snapshot&) = delete;
  Snapshot& operator=(const Snapshot&) = delete;

 private:
  const CampaignFile& file_;
};

}  // namespace tunnelrig
