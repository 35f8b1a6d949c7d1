#include "cli/live/viewers.h"

#include <algorithm>

#include <fmt/format.h>

namespace tunnelrig::live {
namespace {

EventText event_text(std::string_view event, std::string_view json) {
  return std::make_shared<const std::string>(fmt::format("event: {}\ndata: {}\n\n", event, json));
}

}  // namespace

EventText Viewer::next(std::chrono::milliseconds patience) {
  std::unique_lock lock(mutex_);
  filled_.wait_for(lock, patience, [&] { return closed_ || !waiting_.empty(); });
  if (closed_ || waiting_.empty()) return nullptr;
  const Waiting first = std::move(waiting_.front());
  waiting_.pop_front();
  display_ -= first.display ? 1 : 0;
  return first.text;
}

bool Viewer::closed() const {
  const std::lock_guard lock(mutex_);
  return closed_;
}

std::size_t Viewer::put(Waiting event) {
  const std::lock_guard lock(mutex_);
  std::size_t dropped = 0;
  const auto drop = [&](const auto& which) {
    const auto found = std::find_if(waiting_.begin(), waiting_.end(), which);
    if (found == waiting_.end()) return;
    waiting_.erase(found);
  };
  if (!event.display) {
    drop([&](const Waiting& other) { return other.name == event.name; });
  } else if (display_ == kMostDisplay) {
    drop([](const Waiting& other) { return other.display; });
    dropped = 1;
  } else {
    ++display_;
  }
  waiting_.push_back(std::move(event));
  filled_.notify_one();
  return dropped;
}

void Viewer::close() {
  const std::lock_guard lock(mutex_);
  closed_ = true;
  filled_.notify_all();
}

std::shared_ptr<Viewer> Viewers::join() {
  const std::lock_guard lock(mutex_);
  std::erase_if(viewers_, [](const auto& viewer) { return viewer.expired(); });
  if (closed_ || viewers_.size() >= kMost) return nullptr;
  auto viewer = std::make_shared<Viewer>();
  for (const auto& [name, text] : standing_) viewer->put({name, text, false});
  viewers_.push_back(viewer);
  return viewer;
}

void Viewers::tell(std::string_view event, std::string_view json) {
  const EventText text = event_text(event, json);
  const std::lock_guard lock(mutex_);
  const auto found = std::find_if(standing_.begin(), standing_.end(),
                                  [&](const auto& standing) { return standing.first == event; });
  if (found == standing_.end())
    standing_.emplace_back(event, text);
  else
    found->second = text;
  send(event, text, false);
}

void Viewers::show(std::string_view event, std::string_view json) {
  const EventText text = event_text(event, json);
  const std::lock_guard lock(mutex_);
  send(event, text, true);
}

void Viewers::send(std::string_view event, const EventText& text, bool display) {
  for (const auto& weak : viewers_) {
    if (const auto viewer = weak.lock()) dropped_ += viewer->put({std::string(event), text, display});
  }
}

void Viewers::close() {
  const std::lock_guard lock(mutex_);
  closed_ = true;
  for (const auto& weak : viewers_) {
    if (const auto viewer = weak.lock()) viewer->close();
  }
}

std::size_t Viewers::count() const {
  const std::lock_guard lock(mutex_);
  return static_cast<std::size_t>(
      std::count_if(viewers_.begin(), viewers_.end(), [](const auto& viewer) { return !viewer.expired(); }));
}

}  // namespace tunnelrig::live
