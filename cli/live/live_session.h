// A page over a campaign file: server, feed, book and desk together.
#pragma once

#include "cli/live/desk.h"
#include "cli/live/http_server.h"

#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace tunnelrig::live {

inline constexpr int kDefaultPort = 8266;

struct LiveSettings {
  std::filesystem::path campaign;  // must exist
  CampaignInfo info;
  std::vector<PlannedRun> plan;
  bool writable = true;  // false: `serve`, which shows a file and follows who records to it
  std::string source;    // as the recorder names it
  std::string program;   // "tunnelrig 0.1.0"
  std::string address = "127.0.0.1";
  int port = kDefaultPort;
  std::map<std::string, std::optional<double>> metadata;  // what the command line gave
};

class LiveSession {
 public:
  /// Listens and answers from here on. Throws InputError where the port or the address cannot be had.
  /// `stop` is set where a page ends the run.
  LiveSession(LiveSettings settings, std::atomic<bool>& stop);
  ~LiveSession();
  LiveSession(const LiveSession&) = delete;
  LiveSession& operator=(const LiveSession&) = delete;

  std::string address() const { return site_->address(); }
  LiveFeed& feed() { return *feed_; }
  Book& book() { return *book_; }
  Desk& desk() { return *desk_; }

 private:
  void say_hello();
  CommandResult execute(const Command& command);

  LiveSettings settings_;
  std::unique_ptr<HttpServer> server_;  // has the port before anything else begins
  Viewers viewers_;
  std::unique_ptr<LiveFeed> feed_;
  std::unique_ptr<Book> book_;
  std::unique_ptr<Desk> desk_;
  std::unique_ptr<Site> site_;
};

}  // namespace tunnelrig::live
