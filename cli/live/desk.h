// Where commands from the pages meet the loop that logs.
#pragma once

#include "cli/live/book.h"
#include "cli/live/command.h"
#include "cli/live/feed.h"

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <functional>
#include <future>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

namespace tunnelrig::live {

/// Something to be recorded, as a page asked for it.
class Order {
 public:
  explicit Order(Command wish) : command(std::move(wish)) {}

  /// When it has begun, or what prevents it; only the first answer counts.
  void answer(const CommandResult& result) {
    if (!std::exchange(answered_, true)) promise_.set_value(result);
  }
  std::future<CommandResult> answered() { return promise_.get_future(); }

  const Command command;

 private:
  std::promise<CommandResult> promise_;
  bool answered_ = false;
};

/// Carries commands out: those that mark runs at once, in a connection of their own; those that record are
/// handed to the loop.
class Desk {
 public:
  /// `stop` is the flag that ends a run; `changed` is called after metadata were.
  Desk(std::filesystem::path campaign, LiveFeed& feed, Book& book, std::atomic<bool>& stop,
       std::function<void()> changed);

  /// On the threads of the server.
  CommandResult execute(const Command& command);

  /// On the logging thread: the next order, waiting for `patience` at most; null where none came.
  std::unique_ptr<Order> wait(std::chrono::milliseconds patience);

  std::map<std::string, std::optional<double>> metadata() const;

 private:
  CommandResult stop(const Command& command);
  CommandResult hand_over(const Command& command);
  CommandResult mark(const Command& command);
  CommandResult aim(const Command& command);

  std::filesystem::path campaign_;
  LiveFeed& feed_;
  Book& book_;
  std::atomic<bool>& stop_;
  std::function<void()> changed_;

  mutable std::mutex mutex_;  // guards order_ and metadata_
  std::condition_variable came_;
  std::unique_ptr<Order> order_;
  std::map<std::string, std::optional<double>> metadata_;
  std::mutex marking_;  // one edit at a time
};

}  // namespace tunnelrig::live
