#include "cli/live/live_session.h"

#include "cli/live/page/page.h"
#include "datasets/campaign.h"
#include "datasets/error.h"
#include "datasets/recorder_lock.h"

#include <array>

#include <nlohmann/json.hpp>
#include <unistd.h>

namespace tunnelrig::live {
namespace {

using Json = nlohmann::ordered_json;

std::string own_name() {
  std::array<char, 256> name{};
  return ::gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "";
}

}  // namespace

LiveSession::LiveSession(LiveSettings settings, std::atomic<bool>& stop)
    : settings_(std::move(settings)),
      server_(std::make_unique<HttpServer>(settings_.address, settings_.port)) {
  // New viewers are told in the order in which things were first said: before feed and book say anything.
  viewers_.tell("alarms", R"({"active":[]})");
  say_hello();
  feed_ = std::make_unique<LiveFeed>(settings_.info, settings_.campaign, viewers_, running_means);
  book_ = std::make_unique<Book>(BookSettings{settings_.campaign, settings_.plan, !settings_.writable},
                                 viewers_, *feed_);
  desk_ = std::make_unique<Desk>(settings_.campaign, *feed_, *book_, stop, [this] { say_hello(); });
  site_ = std::make_unique<Site>(SiteSettings{.address = settings_.address,
                                              .port = server_->port(),
                                              .open = !is_loopback(settings_.address),
                                              .host_name = own_name(),
                                              .token = random_token(),
                                              .page = page_html()},
                                 [this](const Command& command) { return execute(command); });
  server_->serve(*site_, viewers_);
}

LiveSession::~LiveSession() { server_.reset(); }

CommandResult LiveSession::execute(const Command& command) {
  if (settings_.writable) return desk_->execute(command);
  const auto recorder = recorder_of(settings_.campaign);
  return {.problem = recorder
                         ? fmt::format("this page only reads: process {} records to the file; use its page",
                                       *recorder)
                         : "this page only reads; `tunnelrig log --live` opens one that records",
          .text = ""};
}

void LiveSession::say_hello() {
  const CampaignInfo& info = settings_.info;
  Json json{{"protocol", 1},
            {"mode", settings_.writable ? "log" : "file"},
            {"program", settings_.program},
            {"campaign", info.name},
            {"file", settings_.campaign.filename().string()},
            {"rotors", info.rig.rotors},
            {"sample_rate_hz", info.daq.sample_rate_hz},
            {"nominal_speed_rpm", info.rig.nominal_speed_rpm},
            {"blades", info.rig.blades},
            {"mains_hz", info.daq.mains_hz.value_or(kUsualMains_hz)},
            {"cell_limit_N", info.rig.cell_limit_N},
            {"source", settings_.source},
            {"simulated", settings_.source.starts_with("virtual")},
            {"writable", settings_.writable},
            {"metadata", Json::array()}};
  auto values = settings_.metadata;
  if (desk_)
    for (const auto& [name, value] : desk_->metadata()) values[name] = value;
  for (const MetadataField& field : kMetadata) {
    const auto found = values.find(field.name);
    const auto [low, high] = range_of(field.name).value();
    const bool known = found != values.end() && found->second;
    json["metadata"].push_back({{"name", field.name},
                                {"label", field.label},
                                {"unit", field.unit},
                                {"low", low},
                                {"high", high},
                                {"value", known ? Json(*found->second) : Json(nullptr)}});
  }
  viewers_.tell("hello", json.dump(-1, ' ', false, Json::error_handler_t::replace));
}

}  // namespace tunnelrig::live
