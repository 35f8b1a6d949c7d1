// Who watches: every open page has a queue of its own, bounded, and nobody waits for a slow one.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

namespace tunnelrig::live {

/// Text of a server-sent event, shared by all who are sent it.
using EventText = std::shared_ptr<const std::string>;

/// One open page. Events that describe how things stand (state, alarms, campaign) are never lost: a newer one
/// of a name takes the place of an older one that was not yet sent. Display events (frames, spectrum) are
/// dropped, oldest first, where more than kMostDisplay wait.
class Viewer {
 public:
  /// The next event, waiting for `patience` at most; null where none came.
  EventText next(std::chrono::milliseconds patience);

  /// True once the server ends.
  bool closed() const;

  static constexpr std::size_t kMostDisplay = 40;

 private:
  friend class Viewers;
  struct Waiting {
    std::string name;
    EventText text;
    bool display = false;
  };

  /// How many display events were dropped for it.
  std::size_t put(Waiting event);
  void close();

  mutable std::mutex mutex_;
  std::condition_variable filled_;
  std::deque<Waiting> waiting_;
  std::size_t display_ = 0;  // of those that wait
  bool closed_ = false;
};

class Viewers {
 public:
  /// A new viewer, who is sent at once how things stand; null where there are kMost already. A viewer is gone
  /// when its pointer is.
  std::shared_ptr<Viewer> join();

  /// How things stand: `json` is kept for viewers who come later.
  void tell(std::string_view event, std::string_view json);

  /// For display only.
  void show(std::string_view event, std::string_view json);

  void close();

  std::size_t count() const;
  std::uint64_t dropped() const { return dropped_; }

  static constexpr std::size_t kMost = 16;

 private:
  void send(std::string_view event, const EventText& text, bool display);

  mutable std::mutex mutex_;
  std::vector<std::weak_ptr<Viewer>> viewers_;
  std::vector<std::pair<std::string, EventText>> standing_;  // newest of each name, in order of appearance
  std::atomic<std::uint64_t> dropped_{0};
  bool closed_ = false;
};

}  // namespace tunnelrig::live
