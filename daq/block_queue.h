// What the reading thread hands to the recording one. Private to daq/.
#pragma once

#include "daq/packet_source.h"

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <mutex>
#include <optional>
#include <vector>

namespace tunnelrig {

/// Bytes as they were read, or the news that there were none.
struct Block {
  ReadResult::Status status = ReadResult::Status::kNothing;
  double time_s = 0;
  std::vector<std::byte> bytes;
  const char* cause = nullptr;
};

/// A queue of blocks, bounded by their bytes. A recorder that is held up (a disk that syncs slowly) does not
/// lose what arrives meanwhile: 64 MiB are an hour of the rig. A source that outruns the recorder waits here.
class BlockQueue {
 public:
  explicit BlockQueue(std::size_t limit_bytes) : limit_bytes_(limit_bytes) {}

  /// False where the queue has been closed: the reader then ends.
  bool push(Block block) {
    {
      std::unique_lock lock(mutex_);
      room_.wait(lock, [&] { return closed_ || bytes_ < limit_bytes_; });
      if (closed_) return false;
      bytes_ += block.bytes.size();
      blocks_.push_back(std::move(block));
    }
    filled_.notify_one();  // who wakes finds the mutex free
    return true;
  }

  /// The oldest block, or nothing within the time-out.
  std::optional<Block> pop(std::chrono::milliseconds timeout) {
    std::unique_lock lock(mutex_);
    if (!filled_.wait_for(lock, timeout, [&] { return !blocks_.empty(); })) return {};
    Block block = std::move(blocks_.front());
    blocks_.pop_front();
    bytes_ -= block.bytes.size();
    room_.notify_one();
    return block;
  }

  void close() {
    const std::lock_guard lock(mutex_);
    closed_ = true;
    room_.notify_all();
  }

 private:
  std::size_t limit_bytes_;
  std::mutex mutex_;
  std::condition_variable room_, filled_;
  std::deque<Block> blocks_;
  std::size_t bytes_ = 0;
  bool closed_ = false;
};

}  // namespace tunnelrig
