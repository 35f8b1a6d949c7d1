#include "datasets/snapshot.h"

#include "datasets/sqlite.h"

namespace tunnelrig {

Snapshot::Snapshot(const CampaignFile& file) : file_(file) { file_.database().execute("BEGIN"); }

Snapshot::~Snapshot() {
  sqlite3_exec(file_.database().handle(), "ROLLBACK", nullptr, nullptr, nullptr);  // nothing was written
}

}  // namespace tunnelrig
