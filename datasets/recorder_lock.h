// One recorder per campaign file.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

namespace tunnelrig {

/// Takes the lock on `campaign` or throws InputError naming the process that holds it. The lock is an flock
/// on a file beside the campaign ("FILE.lock"), because SQLite's own locks come and go with each transaction;
/// the kernel drops it with the process, however that ends.
std::shared_ptr<void> lock_for_recording(const std::filesystem::path& campaign);

/// The process that records to `campaign` at this moment, as text; nothing where none does.
std::optional<std::string> recorder_of(const std::filesystem::path& campaign);

}  // namespace tunnelrig
