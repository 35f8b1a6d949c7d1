#include "cli/console.h"
#include "cli/live/live_session.h"
#include "cli/verb.h"
#include "datasets/error.h"
#include "datasets/recorder_lock.h"

#include <atomic>
#include <chrono>
#include <csignal>
#include <memory>
#include <thread>

#include <fmt/format.h>

namespace tunnelrig::cli {
namespace {

struct ServeOptions {
  std::string db, listen = "127.0.0.1";
  int port = live::kDefaultPort;
};

std::atomic<bool> serve_no_longer{false};

void end_serving(int /*signal*/) { serve_no_longer = true; }

int run_serve(const ServeOptions& options) {
  const CampaignFile file(options.db, CampaignFile::Access::kRead);
  live::LiveSettings settings{.campaign = options.db,
                              .info = file.info(),
                              .writable = false,
                              .program = "tunnelrig " + program_version(),
                              .address = options.listen,
                              .port = options.port};
  if (const auto runs = file.runs(); !runs.empty()) {
    const auto source = runs.back().labels.find("source");
    settings.source = source == runs.back().labels.end() ? "" : source->second;
  }
  std::signal(SIGINT, end_serving);
  std::signal(SIGTERM, end_serving);
  const live::LiveSession page(std::move(settings), serve_no_longer);
  fmt::print("live page: {}\n", page.address());
  if (const auto recorder = recorder_of(options.db))
    fmt::print("process {} records to {}: the page only reads, and follows\n", *recorder, options.db);
  std::fflush(stdout);
  while (!serve_no_longer) std::this_thread::sleep_for(std::chrono::milliseconds(100));
  return kWell;
}

}  // namespace

void add_serve(CLI::App& app, Work& work) {
  auto options = std::make_shared<ServeOptions>();
  CLI::App* verb =
      app.add_subcommand("serve", "A page over a campaign file: runs, locations, maps; it only reads");
  verb->footer(
      "Follows while another process records to the file. Ctrl-C ends it. docs/live.md.\n\n"
      "Example: tunnelrig serve --db my.db");
  verb->add_option("--db", options->db, "Campaign file")->required();
  verb->add_option("--port", options->port, "Port; 0: any that is free")
      ->check(CLI::Range(0, 65535))
      ->capture_default_str();
  verb->add_option("--listen", options->listen,
                   "Address of this computer to listen on; where it is not the loopback, a token is needed")
      ->capture_default_str();
  verb->callback([options, &work] { work = [options] { return run_serve(*options); }; });
}

}  // namespace tunnelrig::cli
