// A recording, watched over real sockets while it runs.
#include "cli/live/feed.h"

#include "cli/live/client.h"
#include "cli/live/http_server.h"
#include "cli/live/run_alarms.h"
#include "daq/logging.h"
#include "daq/virtual_board.h"
#include "daq/virtual_rig.h"
#include "support/message_of.h"

#include <cmath>
#include <numbers>
#include <set>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace tunnelrig::live {
namespace {

using nlohmann::json;
using testing::HasSubstr;

constexpr const char* kToken = "0123456789abcdef0123456789abcdef";

/// The means alone; their errors belong to the analysis.
RunningMeans plain_means(const RunningBlocks& blocks, const Scale& scale, const CampaignInfo& info,
                         std::optional<double> /*air_temperature_C*/) {
  RunningMeans means;
  for (std::size_t c = 0; c < static_cast<std::size_t>(info.rig.rotors); ++c)
    means.rotors.push_back({scale.value(c, blocks.mean()[c]), {}});
  return means;
}

/// Server and feed over a campaign file.
struct Watched : testing::Test {
  test::TemporaryFolder folder;
  CampaignFile file = test::new_campaign(folder / "c.db");
  Viewers viewers;
  LiveFeed feed{file.info(), folder / "c.db", viewers, plain_means};
  std::unique_ptr<HttpServer> server = std::make_unique<HttpServer>("127.0.0.1", 0);
  Site site{{.port = server->port(), .token = kToken, .page = "the page"}, [](const Command& command) {
              return CommandResult{"", command.name};
            }};

  void SetUp() override { server->serve(site, viewers); }
  void TearDown() override { server.reset(); }
  int port() const { return server->port(); }

  LogOutcome record(PacketSource& board, const LiveRun& run) {
    feed.begin(run);
    return log_run(
        board, file, test::cells(run.run), {.duration_s = run.duration_s, .watcher = &feed.watcher()},
        test::summarizer(), [&](const LogProgress& progress) { feed.progress(progress); },
        test::never_stop());
  }

  std::unique_ptr<PacketSource> rig(const LiveRun& run, const std::string& faults = "") const {
    const VirtualRig virtual_rig(file.info(), {});
    return virtual_rig.board({.session = "S1", .location = "OT", .duration_s = run.duration_s}, 1,
                             parse_faults(faults));
  }
};

TEST_F(Watched, TracesComeTwentyTimesASecondAndHideNothing) {
  const LiveRun run{.run = "R1", .location = "OT", .session = "S1", .duration_s = 4};
  const auto board = rig(run);
  std::set<double> begins;
  double low = 1e9, high = -1e9;
  std::size_t events = 0, bins = 0, spectra = 0;
  std::thread page([&] {
    test::EventStream stream(port());
    while (const auto text = stream.next("frames", {}, std::chrono::milliseconds(1500))) {
      const json frames = json::parse(*text);
      EXPECT_EQ(frames["run"], "R1");
      EXPECT_EQ(frames["unit"], "V");
      EXPECT_EQ(frames["low"].size(), 4u);
      EXPECT_TRUE(begins.insert(frames["t_s"].get<double>()).second);
      ++events;
      for (std::size_t i = 0; i < frames["low"][2].size(); ++i, ++bins) {
        ASSERT_FALSE(frames["low"][2][i].is_null());
        low = std::min(low, frames["low"][2][i].get<double>());
        high = std::max(high, frames["high"][2][i].get<double>());
      }
    }
  });
  std::thread other([&] {
    test::EventStream stream(port());
    const auto text = stream.next("spectrum");
    ASSERT_TRUE(text);
    ++spectra;
    const json spectrum = json::parse(*text);
    EXPECT_EQ(spectrum["amplitude"][0].size(), 1025u);
    for (const json& line : spectrum["lines"]) {
      if (line["name"] == "shaft") {
        EXPECT_NEAR(line["frequency_hz"], 5000.0 / 60, 0.5);
      }
      EXPECT_EQ(line["alias"], line["frequency_hz"].get<double>() > 4000.0 / 6);
    }
  });
  while (viewers.count() < 2) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  const LogOutcome outcome = record(*board, run);
  feed.place({.phase = Phase::kIdle, .run = run});
  page.join();
  other.join();
  EXPECT_EQ(outcome.state, RunState::kComplete);
  EXPECT_EQ(bins, 400u) << "every 10 ms once";
#if !defined(__SANITIZE_THREAD__)
  EXPECT_GE(events, 80u);
#endif
  EXPECT_EQ(spectra, 1u);
  EXPECT_NEAR(low, outcome.statistics.channels[2].lowest_V, 1e-4);
  EXPECT_NEAR(high, outcome.statistics.channels[2].highest_V, 1e-4);
}

TEST_F(Watched, TheShaftIsLookedForAtTheRunsOwnSpeed) {
  LiveRun run{.run = "R1", .location = "OT", .session = "S1", .duration_s = 5};
  run.speed_rpm = 3300;
  VirtualBoard board({.frame_rate_hz = 4000.0 / 3, .pace = 1}, [n = 0]() mutable {
    const double turns = 55.0 * 3 / 4000 * ++n;
    const auto sample =
        static_cast<std::int16_t>(2000 + 200 * std::sin(2 * std::numbers::pi * turns) + n * 7 % 5);
    return trw_frame{.sample = {sample, sample, sample, sample}, .status = 0};
  });
  test::EventStream stream(port());
  record(board, run);
  const auto text = stream.next("spectrum");
  ASSERT_TRUE(text);
  const json spectrum = json::parse(*text);
  EXPECT_EQ(spectrum["lines"][0]["name"], "shaft");
  EXPECT_NEAR(spectrum["lines"][0]["frequency_hz"].get<double>(), 55, 0.5)
      << "83 Hz is the rig's nominal speed";
}

TEST_F(Watched, StateTellsMeansAndLosses) {
  const LiveRun run{.run = "R1", .location = "OT", .session = "S1", .duration_s = 2};
  CellKnowledge cells;
  cells.cells.emplace();
  cells.cells->fill({.newtons_per_V = 4, .zero_V = 0.34});
  feed.know(cells);
  test::EventStream stream(port());
  const LogOutcome outcome = record(*rig(run, "drop=0.1"), run);
  ASSERT_GT(outcome.ledger.frames_lost, 0u);
  const auto alarms =
      stream.next("alarms", [](const std::string& text) { return text.find("loss") != text.npos; });
  ASSERT_TRUE(alarms);
  EXPECT_EQ(feed.end(outcome), "loss");
  feed.place({.phase = Phase::kIdle, .run = run});
  const auto text =
      stream.next("state", [](const std::string& state) { return json::parse(state)["phase"] == "idle"; });
  ASSERT_TRUE(text);
  const json state = json::parse(*text);
  EXPECT_EQ(state["ledger"]["stored"], outcome.ledger.frames_stored);
  EXPECT_EQ(state["ledger"]["lost"], outcome.ledger.frames_lost);
  EXPECT_EQ(state["means"][1]["unit"], "N");
  EXPECT_NEAR(state["means"][1]["mean"], 4 * (outcome.statistics.channels[1].mean_V - 0.34), 0.02);
  EXPECT_EQ(state["viewers"], 1);
  EXPECT_GT(state["disk_free_B"], 0);
}

TEST_F(Watched, ChannelsThatAreWrongAlarm) {
  const LiveRun run{.run = "R1", .location = "OT", .session = "S1", .duration_s = 2};
  auto count = std::make_shared<int>(0);
  VirtualBoard board({.pace = 1}, [count] {
    const int n = ++*count;
    const auto moving = static_cast<std::int16_t>(2000 + n % 17);
    return trw_frame{
        .sample = {moving, 1500, static_cast<std::int16_t>(n % 50 == 0 ? 4095 : moving), moving}};
  });
  CellKnowledge cells;
  cells.cells.emplace();
  cells.cells->fill({.newtons_per_V = 4, .zero_V = 0.34});
  (*cells.cells)[3].newtons_per_V = 12;
  cells.tares["S1"] = {.drift_V = 0.5, .drift_rotor = 1};
  feed.know(cells);
  test::EventStream stream(port());
  const LogOutcome outcome = record(board, run);
  const auto text =
      stream.next("alarms", [](const std::string& alarms) { return alarms.find("overload") != alarms.npos; });
  ASSERT_TRUE(text);
  std::set<std::pair<std::string, int>> active;
  const json alarms_then = json::parse(*text);
  for (const json& alarm : alarms_then["active"])
    active.emplace(alarm["kind"], alarm["rotor"].is_null() ? 0 : alarm["rotor"].get<int>());
  EXPECT_THAT(active, testing::IsSupersetOf({std::pair<std::string, int>("stuck", 2),
                                             {"clipping", 3},
                                             {"overload", 3},
                                             {"overload", 4},
                                             {"tare_drift", 1}}));
  EXPECT_EQ(feed.end(outcome), "clipping;overload;stuck;tare_drift");
}

/// The page never costs data, whatever its computations come to. Texts may be no UTF-8: the system's are not
/// ours.
TEST(Feed, AFailureIsTheDisplaysAlone) {
  const test::TemporaryFolder folder;
  CampaignFile file = test::new_campaign(folder / "c.db");
  Viewers viewers;
  std::atomic<bool> failing = true;
  LiveFeed feed(file.info(), folder / "c.db", viewers,
                [&](const RunningBlocks& blocks, const Scale& scale, const CampaignInfo& info,
                    std::optional<double> air_temperature_C) {
                  if (failing) throw std::runtime_error("no \xFF means");
                  return plain_means(blocks, scale, info, air_temperature_C);
                });
  const auto page = viewers.join();
  const auto next = [&](const std::string& what) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(10);
    while (std::chrono::steady_clock::now() < end) {
      const EventText event = page->next(std::chrono::milliseconds(100));
      if (event && event->find(what) != std::string::npos) return *event;
    }
    return std::string();
  };
  const VirtualRig virtual_rig(file.info(), {});
  const LiveRun run{.run = "R1", .location = "OT", .session = "S1", .duration_s = 1};
  feed.begin(run);
  const LogOutcome outcome = log_run(
      *virtual_rig.board({.session = "S1", .location = "OT", .duration_s = 1}, 1, {}), file,
      test::cells("R1"), {.duration_s = 1, .watcher = &feed.watcher()}, test::summarizer(),
      [&](const LogProgress& progress) { feed.progress(progress); }, test::never_stop());
  EXPECT_EQ(outcome.state, RunState::kComplete);
  EXPECT_THAT(next("\"kind\":\"display\""), HasSubstr("means; the recording goes on"));
  EXPECT_EQ(feed.end(outcome), "display");
  failing = false;
  EXPECT_THAT(next("event: state"), HasSubstr("\"means\":[{"));
}

/// Between a run's end and the next one's begin a stop would end the next one, or be forgotten.
TEST_F(Watched, OnlyTheRunThatIsRecordedIsStopped) {
  std::atomic<bool> stop = false;
  const LiveRun run{.run = "R1", .location = "OT", .session = "S1"};
  feed.know({});
  EXPECT_EQ(feed.raise_in_run("R1", stop).phase, Phase::kIdle);
  feed.begin(run);
  EXPECT_EQ(feed.raise_in_run("R0", stop).run.run, "R1");
  EXPECT_FALSE(stop) << "meant for the one before";
  feed.raise_in_run("R1", stop);
  EXPECT_TRUE(stop.exchange(false));
  feed.raise_in_run("", stop);
  EXPECT_TRUE(stop.exchange(false));
  feed.end({});
  EXPECT_NE(feed.position().phase, Phase::kRecording);
  feed.raise_in_run("", stop);
  EXPECT_FALSE(stop);
}

TEST(Disk, AFullOneIsLowToo) {
  constexpr std::uintmax_t kGB = 1'000'000'000;
  EXPECT_FALSE(is_low({})) << "not known yet";
  EXPECT_FALSE(is_low({.capacity = 100 * kGB, .free = 50 * kGB, .available = 45 * kGB}));
  EXPECT_TRUE(is_low({.capacity = 100 * kGB, .free = kGB, .available = kGB / 3}));
  EXPECT_TRUE(is_low({.capacity = 100 * kGB, .free = 5 * kGB, .available = 0})) << "but for the superuser";
}

TEST_F(Watched, RequestsAreAnsweredAndRefusedOverTheSocket) {
  EXPECT_EQ(test::get(port(), "/").body, "the page");
  EXPECT_EQ(test::get(port(), "/../../etc/passwd").status, 404);
  EXPECT_EQ(test::get(port(), "/%2e%2e/%2e%2e/etc/passwd").status, 404);
  EXPECT_EQ(test::ask(port(), "GET / HTTP/1.1\r\nHost: evil.example\r\n\r\n").status, 403);
  const test::HttpReply done =
      test::post(port(), std::string(R"({"command":"stop","token":")") + kToken + "\"}");
  EXPECT_EQ(done.status, 200);
  EXPECT_THAT(done.body, HasSubstr(R"("text":"stop")"));
  EXPECT_EQ(test::post(port(), R"({"command":"stop"})").status, 403);
  EXPECT_EQ(test::post(port(), std::string(Site::kLongestBody + 1, ' ')).status, 413);
  const std::string host = "Host: 127.0.0.1:" + std::to_string(port()) + "\r\n";
  EXPECT_EQ(
      test::ask(
          port(),
          "POST /command HTTP/1.1\r\n" + host +
              "Content-Type: application/json\r\nTransfer-Encoding: chunked\r\n\r\n5\r\n{}   \r\n0\r\n\r\n")
          .status,
      411);
  EXPECT_EQ(test::ask(port(), "PUT / HTTP/1.1\r\n" + host + "Content-Length: 0\r\n\r\n").status, 405);
  EXPECT_EQ(
      test::ask(port(), "GET /" + std::string(20000, 'x') + " HTTP/1.1\r\n" + host + "\r\n").status / 100, 4);
  // what follows a refused request on the same connection is not taken for another one
  const std::string smuggled =
      "POST /events HTTP/1.1\r\n" + host + "Content-Length: 70\r\n\r\nGET / HTTP/1.1\r\n" + host + "\r\n";
  EXPECT_THAT(test::ask(port(), smuggled).body, testing::Not(HasSubstr("the page")));
  for (const char* garbage : {"", "\r\n\r\n", "GET\r\n\r\n", "\x16\x03\x01", "GET / HTTP/9.9\r\n\r\n"})
    test::ask(port(), std::string(garbage) + "\r\n\r\n");
  EXPECT_EQ(test::get(port(), "/").status, 200) << "and goes on";
}

TEST_F(Watched, SeventeenthPageIsRefusedAndMayComeLater) {
  viewers.tell("hello", "1");
  std::vector<std::unique_ptr<test::EventStream>> pages;
  for (std::size_t i = 0; i < Viewers::kMost; ++i) {
    pages.push_back(std::make_unique<test::EventStream>(port()));
    ASSERT_TRUE(pages.back()->next("hello"));
  }
  EXPECT_EQ(test::get(port(), "/events").status, 503);
  EXPECT_EQ(test::get(port(), "/").status, 200);
  pages.pop_back();
  bool came = false;
  for (int i = 0; i < 100 && !came; ++i) {
    viewers.show("frames", "{}");  // the server notices who left when it writes
    test::EventStream again(port());
    came = again.next("hello", {}, std::chrono::milliseconds(100)).has_value();
  }
  EXPECT_TRUE(came);
}

TEST(Server, SaysWhatToDoWhereItCannotListen) {
  const HttpServer first("127.0.0.1", 0);
  const auto message = [](const std::string& address, int port) {
    return test::message_of([&] { const HttpServer server(address, port); });
  };
  EXPECT_THAT(message("127.0.0.1", first.port()),
              HasSubstr(fmt::format("port {} of 127.0.0.1 is taken", first.port())));
  EXPECT_THAT(message("203.0.113.7", 0), HasSubstr("no address of this computer"));
}

}  // namespace
}  // namespace tunnelrig::live
