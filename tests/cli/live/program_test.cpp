// `log --live` and `serve` as a person at the rig meets them: the program itself, over real sockets.
#include "cli/program.h"

#include "cli/live/client.h"
#include "datasets/campaign_file.h"
#include "datasets/raw_store.h"
#include "datasets/run_marks.h"
#include "datasets/sqlite.h"
#include "support/temporary_folder.h"

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <sys/wait.h>
#include <unistd.h>

namespace tunnelrig {
namespace {

using nlohmann::json;
using test::EventStream;
using testing::HasSubstr;
using testing::Not;

/// The program, running beside the test, with its page.
class Served {
 public:
  Served(const std::filesystem::path& folder, const std::string& arguments) {
    std::array<int, 2> out{};
    if (::pipe(out.data()) != 0) throw std::runtime_error("no pipe");
    pid_ = ::fork();
    if (pid_ == 0) {
      ::dup2(out[1], STDOUT_FILENO);
      ::close(out[0]);
      ::close(out[1]);
      const std::string command = "cd '" + folder.string() + "' && exec '" TUNNELRIG_PROGRAM "' " +
                                  arguments + " 2>error.txt </dev/null";
      ::execl("/bin/sh", "sh", "-c", command.c_str(), nullptr);
      ::_exit(127);
    }
    ::close(out[1]);
    out_ = ::fdopen(out[0], "r");
    std::array<char, 512> line{};
    while (address_.empty() && std::fgets(line.data(), line.size(), out_) != nullptr) {
      const std::string text = line.data();
      if (text.starts_with("live page: ")) address_ = text.substr(11, text.size() - 12);
    }
    if (address_.empty()) return;
    port_ = std::stoi(address_.substr(address_.find(':', 7) + 1));
    const auto token = address_.find("?token=");
    query_ = token == std::string::npos ? "" : address_.substr(token);
    const std::string page = test::get(port_, "/" + query_).body;
    const auto at = page.find("name=\"token\" content=\"");
    if (at != std::string::npos) token_ = page.substr(at + 22, 32);
  }
  ~Served() {
    if (pid_ > 0) stop();
    std::fclose(out_);
  }
  Served(const Served&) = delete;
  Served& operator=(const Served&) = delete;

  int stop(int signal = SIGINT) {
    ::kill(pid_, signal);
    int status = 0;
    ::waitpid(pid_, &status, 0);
    pid_ = 0;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

  int port() const { return port_; }
  const std::string& address() const { return address_; }

  test::HttpReply command(json fields) const {
    fields["token"] = token_;
    return test::post(port_, fields.dump());
  }

 private:
  pid_t pid_ = 0;
  std::FILE* out_ = nullptr;
  std::string address_, query_, token_;
  int port_ = 0;
};

struct LivePage : testing::Test {
  test::TemporaryFolder folder;

  test::ProgramResult run(const std::string& arguments) const {
    return test::run_program(folder.path(), arguments);
  }
  CampaignFile file() const { return {folder / "c.db", CampaignFile::Access::kRead}; }

  /// A calibrated file that holds one tare.
  void prepare() const {
    ASSERT_EQ(run("log --db c.db --location OT --session S1 --kind tare --duration 5 --speed max").code, 0);
    ASSERT_EQ(run("calibrate --db c.db").code, 0);
  }
};

std::function<bool(const std::string&)> where(const std::function<bool(const json&)>& wanted) {
  return [wanted](const std::string& text) { return wanted(json::parse(text)); };
}

/// Waits until a run is over.
void until_over(EventStream& stream, const std::string& run, const std::string& phase = "idle") {
  EXPECT_TRUE(stream.next("state",
                          where([&](const json& now) { return now["run"] == run && now["phase"] == phase; })))
      << run;
}

TEST_F(LivePage, SteersARecording) {
  Served log(folder.path(), "log --db c.db --source virtual --live 0 --duration 1 --speed 4");
  ASSERT_GT(log.port(), 0);
  EventStream stream(log.port());
  const auto hello = stream.next("hello");
  ASSERT_TRUE(hello);
  EXPECT_EQ(json::parse(*hello)["mode"], "log");
  EXPECT_EQ(json::parse(*hello)["simulated"], true);

  EXPECT_EQ(log.command({{"command", "stop"}}).status, 409);
  EXPECT_EQ(log.command({{"command", "next"}}).status, 409) << "there is no plan";
  EXPECT_EQ(log.command({{"command", "note"}, {"text", "too early"}}).status, 409);
  EXPECT_EQ(log.command({{"command", "tare"}}).status, 200);
  until_over(stream, "R0001");
  EXPECT_EQ(log.command({{"command", "metadata"}, {"values", {{"air_temperature_C", 18.25}}}}).status, 200);
  const auto again = stream.next("hello");
  ASSERT_TRUE(again) << "everybody is told";
  EXPECT_THAT(*again, HasSubstr("18.25"));
  const auto nowhere = log.command({{"command", "start"}, {"location", "NOWHERE"}});
  EXPECT_EQ(nowhere.status, 409);
  EXPECT_THAT(nowhere.body, HasSubstr("NOWHERE"));
  EXPECT_EQ(log.command({{"command", "start"}, {"location", "H1V1"}, {"duration_s", 2}}).status, 200);
  EXPECT_EQ(log.command({{"command", "start"}, {"location", "OT"}}).status, 409) << "one at a time";
  EXPECT_EQ(log.command({{"command", "note"}, {"text", "door\nopen"}}).status, 200) << "the run under way";
  until_over(stream, "R0002");
  EXPECT_EQ(log.command({{"command", "exclude"}, {"run", "R0002"}}).status, 400) << "without a reason";
  EXPECT_EQ(log.command({{"command", "exclude"}, {"run", "R0099"}, {"reason", "x"}}).status, 400);
  EXPECT_EQ(log.command({{"command", "redo"}, {"run", "R0002"}}).status, 200);
  until_over(stream, "R0003");
  EXPECT_EQ(log.command({{"command", "start"}, {"location", "OT"}, {"duration_s", 60}}).status, 200);
  const auto late = log.command({{"command", "stop"}, {"run", "R0003"}});
  EXPECT_EQ(late.status, 409) << "meant for the run before";
  EXPECT_THAT(late.body, HasSubstr("R0004 is being recorded, not R0003"));
  EXPECT_EQ(log.command({{"command", "stop"}, {"run", "R0004"}}).status, 200);
  until_over(stream, "R0004");
  EXPECT_EQ(log.command({{"command", "exclude"}, {"run", "R0001"}, {"reason", "motor ran"}}).status, 200);
  EXPECT_EQ(log.command({{"command", "include"}, {"run", "R0001"}}).status, 200);
  EXPECT_EQ(log.command({{"command", "include"}, {"run", "R0001"}}).status, 400);
  const auto campaign = stream.next("campaign", where([](const json& now) {
                                      return now["runs"].size() == 4 && now["runs"][0]["notes"].size() == 1 &&
                                             now["runs"][3]["state"] == "partial";
                                    }));
  ASSERT_TRUE(campaign);
  const json runs = json::parse(*campaign)["runs"];
  EXPECT_EQ(runs[1]["notes"], json({"door open"}));
  EXPECT_EQ(runs[1]["excluded"], "redone as R0003");
  EXPECT_EQ(runs[2]["location"], "H1V1");
  EXPECT_EQ(runs[2]["repeat"], runs[1]["repeat"]);
  EXPECT_EQ(runs[2]["frames"], 2667) << "as long as the first";
  EXPECT_EQ(log.stop(), 1) << "a partial run is a problem";

  const auto stored = file().runs();
  ASSERT_EQ(stored.size(), 4u);
  EXPECT_EQ(stored[1].number("air_temperature_C"), 18.25);
  EXPECT_EQ(stored[0].note, "was excluded: motor ran");
  EXPECT_EQ(raw_run(file(), "R0004")->state, RunState::kPartial);
}

TEST_F(LivePage, ExcludedRunsAreLeftOutEverywhereAndTravel) {
  prepare();
  {
    Served log(folder.path(), "log --db c.db --live 0 --duration 5 --speed 40 --session S1");
    EventStream stream(log.port());
    for (int repeat = 0; repeat < 3; ++repeat) {
      ASSERT_EQ(log.command({{"command", "start"}, {"location", "OT"}}).status, 200);
      until_over(stream, fmt::format("R{:04}", repeat + 2));
    }
    ASSERT_EQ(
        log.command({{"command", "exclude"}, {"run", "R0003"}, {"reason", "a draught, \"sudden\""}}).status,
        200);
    EXPECT_EQ(log.stop(), 0);
  }
  const auto reduced = run("reduce --db c.db --runs-csv runs.csv");
  EXPECT_EQ(reduced.code, 0) << reduced.error;
  EXPECT_THAT(reduced.error, HasSubstr("run R0003 is left out: excluded: a draught, \"sudden\""));
  EXPECT_THAT(read_text(folder / "runs.csv"), Not(HasSubstr("R0003")));
  EXPECT_THAT(run("doctor --db c.db").out, HasSubstr("R0003 (a draught, \"sudden\")"));
  ASSERT_EQ(run("export --db c.db out").code, 0);
  EXPECT_THAT(read_text(folder / "out" / "runs.csv"), HasSubstr("\"a draught, \"\"sudden\"\"\""));
  ASSERT_EQ(run("import out --db again.db").code, 0);
  EXPECT_EQ(CampaignFile(folder / "again.db", CampaignFile::Access::kRead).runs().at(2).excluded,
            "a draught, \"sudden\"");
}

TEST_F(LivePage, WalksAPlanAndShowsTheMaps) {
  prepare();
  std::string plan = "session,kind,location,repeat,duration_s\n";
  for (const char* location : {"OT", "H2V2", "H4V-1", "H1V-3", "H5V1"})
    plan += fmt::format("S1,thrust,{0},1,5\nS1,thrust,{0},2,5\n", location);
  write_text(folder / "plan.csv", plan);
  {
    Served log(folder.path(), "log --db c.db --plan plan.csv --live 0 --speed 40");
    EventStream stream(log.port());
    const auto first = stream.next("state", where([](const json& now) { return now["phase"] == "waiting"; }));
    ASSERT_TRUE(first);
    EXPECT_EQ(json::parse(*first)["next_location"], "OT");
    for (int location = 0; location < 5; ++location) {
      ASSERT_EQ(log.command({{"command", "next"}}).status, 200);
      until_over(stream, fmt::format("R{:04}", 3 + 2 * location), location < 4 ? "waiting" : "finished");
    }
    EventStream later(log.port());  // whatever has been told before is told to it again
    // Maps may come before the last run is counted.
    const auto all_done = [](const json& standing) {
      const json& places = standing["locations"];
      return !standing["maps"].is_null() && std::all_of(places.begin(), places.end(), [](const json& place) {
        return place["state"] == "done" && place["done"] == 2;
      });
    };
    const auto campaign = later.next("campaign", where(all_done));
    ASSERT_TRUE(campaign);
    const json now = json::parse(*campaign);
    EXPECT_EQ(now["locations"].size(), 5u);
    EXPECT_EQ(now["maps"]["delta_ct"]["value_percent"].size(), 21u);
    EXPECT_EQ(now["maps"]["delta_ct"]["value_percent"][10][10], 0) << "at OT";
    EXPECT_GT(now["runs"][1]["c_t"], 0.09);
    EXPECT_EQ(log.stop(SIGTERM), 0);
  }
  // and with --yes it ends by itself, having nothing left to do
  EXPECT_EQ(run("log --db c.db --plan plan.csv --live 0 --speed max --yes").code, 0);
  EXPECT_EQ(file().runs().size(), 11u);

  Served serve(folder.path(), "serve --db c.db --port 0");
  EventStream stream(serve.port());
  const auto hello = stream.next("hello");
  ASSERT_TRUE(hello);
  EXPECT_EQ(json::parse(*hello)["mode"], "file");
  EXPECT_TRUE(stream.next("campaign", where([](const json& now) { return !now["maps"].is_null(); })));
  const auto refused = serve.command({{"command", "exclude"}, {"run", "R0002"}, {"reason", "x"}});
  EXPECT_EQ(refused.status, 409);
  EXPECT_THAT(refused.body, HasSubstr("only reads"));
  EXPECT_EQ(serve.stop(), 0);

  CampaignFile edited(folder / "c.db", CampaignFile::Access::kWrite);
  exclude_run(edited, "R0003", "a draught");
  EXPECT_THAT(run("map --db c.db --out maps").error, HasSubstr("run R0003 is left out: excluded: a draught"));
}

TEST_F(LivePage, ServeFollowsWhoRecords) {
  prepare();
  Served log(folder.path(), "log --db c.db --live 0 --session S1");
  Served serve(folder.path(), "serve --db c.db --port 0");
  EventStream stream(serve.port());
  ASSERT_EQ(log.command({{"command", "start"}, {"location", "OT"}, {"duration_s", 60}}).status, 200);
  const auto state = stream.next("state", where([](const json& now) {
                                   return now["phase"] == "recording" && now["run"] == "R0002" &&
                                          now["ledger"]["stored"] > 500;
                                 }));
  EXPECT_TRUE(state);
  EXPECT_THAT(serve.command({{"command", "stop"}}).body, HasSubstr("records to the file"));
  log.command({{"command", "stop"}});
  EXPECT_TRUE(stream.next("campaign", where([](const json& now) {
                            return now["runs"].size() == 2 && now["runs"][1]["state"] == "partial";
                          })));
  const auto second = run("log --db c.db --live 0");
  EXPECT_EQ(second.code, 2);
  EXPECT_THAT(second.error, HasSubstr("is being recorded to by process"));
}

TEST_F(LivePage, AnotherProgramThatHoldsTheFileDoesNotEndIt) {
  prepare();
  Served log(folder.path(), "log --db c.db --live 0 --session S1");
  EventStream stream(log.port());
  const json start = {{"command", "start"}, {"location", "OT"}, {"duration_s", 1}};
  {
    const Database other((folder / "c.db").string(), SQLITE_OPEN_READWRITE);
    const Transaction writing(other);
    EXPECT_THAT(log.command(start).body, HasSubstr("has not begun yet"));
    EXPECT_EQ(log.command({{"command", "stop"}}).status, 200);
    until_over(stream, "R0002");
  }
  EXPECT_EQ(log.command(start).status, 200);
  until_over(stream, "R0002", "recording");
  until_over(stream, "R0002");
  EXPECT_EQ(raw_run(file(), "R0002").value().state, RunState::kComplete);
  EXPECT_EQ(log.stop(), 0);
}

TEST_F(LivePage, BadInputHasAWayOn) {
  prepare();
  Served serve(folder.path(), "serve --db c.db --port 0");
  const auto taken = run(fmt::format("serve --db c.db --port {}", serve.port()));
  EXPECT_EQ(taken.code, 2);
  EXPECT_THAT(taken.error, HasSubstr(fmt::format("port {} of 127.0.0.1 is taken", serve.port())));
  const auto foreign = run("log --db c.db --live 0 --listen 203.0.113.7");
  EXPECT_EQ(foreign.code, 2);
  EXPECT_THAT(foreign.error, HasSubstr("no address of this computer"));
  EXPECT_EQ(run("log --db c.db --listen 0.0.0.0 --location OT --session S1").code, 2)
      << "--listen without --live";
  EXPECT_EQ(run("serve --db nowhere.db").code, 2);
  CampaignFile(folder / "c.db", CampaignFile::Access::kWrite).database().execute("PRAGMA user_version = 99");
  const auto newer = run("serve --db c.db --port 0");
  EXPECT_EQ(newer.code, 2);
  EXPECT_THAT(newer.error, HasSubstr("schema version 99"));
}

TEST_F(LivePage, OpenToOthersTheAddressCarriesTheToken) {
  prepare();
  Served serve(folder.path(), "serve --db c.db --port 0 --listen 0.0.0.0");
  EXPECT_THAT(serve.address(), HasSubstr("?token="));
  EXPECT_EQ(test::get(serve.port(), "/").status, 403);
  EXPECT_EQ(test::get(serve.port(), "/events").status, 403);
  const std::string query = serve.address().substr(serve.address().find('?'));
  EXPECT_EQ(test::get(serve.port(), "/" + query).status, 200);
  EventStream stream(serve.port(), "/events" + query);
  EXPECT_TRUE(stream.next("hello"));
}

TEST_F(LivePage, TenThousandRuns) {
  Sheet sheet{.file = "runs.csv",
              .columns = {"run", "location", "repeat", "session", "start_utc", "raw", "air_temperature_C",
                          "thrust_1_N", "thrust_2_N", "thrust_3_N", "thrust_4_N"},
              .rows = {}};
  const std::vector<std::string> places = {"OT", "H2V2", "H4V-1", "H1V-3", "H5V1"};
  for (int i = 0; i < 10000; ++i) {
    const std::string thrust = fmt::format("{:.3f}", 7 + 0.001 * (i % 37) + 0.05 * (i % 5));
    sheet.rows.push_back(
        {{fmt::format("R{:05}", i), places[static_cast<std::size_t>(i) % 5], fmt::format("{}", i / 5),
          fmt::format("S{}", i / 500), format_utc(1.7e9 + 60 * i), "", "20", thrust, thrust, thrust, thrust},
         i + 2});
  }
  {
    CampaignFile made(folder / "c.db", CampaignFile::Access::kRecord);
    made.atomically([&] {
      made.set_text("campaign.toml", reference_campaign_toml());
      made.set_sheet("runs", sheet);
    });
  }
  Served serve(folder.path(), "serve --db c.db --port 0");
  EventStream stream(serve.port());
  const auto begin = std::chrono::steady_clock::now();
  const auto campaign = stream.next("campaign", where([](const json& now) { return !now["maps"].is_null(); }),
                                    std::chrono::seconds(180));
  ASSERT_TRUE(campaign);
  EXPECT_EQ(json::parse(*campaign)["runs"].size(), 10000u);
  RecordProperty("bytes", static_cast<int>(campaign->size()));
  RecordProperty("milliseconds", static_cast<int>(std::chrono::duration_cast<std::chrono::milliseconds>(
                                                      std::chrono::steady_clock::now() - begin)
                                                      .count()));
}

}  // namespace
}  // namespace tunnelrig
