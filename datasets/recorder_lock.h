// One recorder per campaign file. Private to datasets/.
#pragma once

#include <filesystem>
#include <memory>

namespace tunnelrig {

/// Takes the lock on `campaign` or throws InputError naming the process that holds it. The lock is an flock
/// on a file beside the campaign ("FILE.lock"), because SQLite's own locks come and go with each transaction;
/// the kernel drops it with the process, however that ends.
std::shared_ptr<void> lock_for_recording(const std::filesystem::path& campaign);

}  // namespace tunnelrig
