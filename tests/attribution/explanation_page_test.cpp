// The page of `explain --html`, made by the program from generated campaigns and opened in a real browser.
#include "attribution/generator/campaign.h"
#include "cli/program.h"
#include "datasets/csv.h"
#include "support/temporary_folder.h"

#include <cmath>
#include <cstdlib>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

namespace tunnelrig::attribution {
namespace {

using nlohmann::json;
using test::ProgramResult;
using test::run_program;
using testing::HasSubstr;

struct ExplanationPage : testing::Test {
  test::TemporaryFolder folder;

  /// Generates and imports; `name`.db is the campaign file.
  void campaign(const std::string& name, const Settings& settings) const {
    write_folder(generate(settings), folder / name);
    const ProgramResult imported = run_program(folder.path(), fmt::format("import {0} --db {0}.db", name));
    ASSERT_EQ(imported.code, 0) << imported.error;
    if (settings.raw) run_program(folder.path(), fmt::format("calibrate --db {}.db", name));
  }
  json explain(const std::string& name, const std::string& options = "") const {
    const ProgramResult result = run_program(
        folder.path(), fmt::format("explain --db {0}.db --simulations 99 --json {0}.json --html {0}.html {1}",
                                   name, options));
    EXPECT_EQ(result.code, 0) << result.error;
    return json::parse(read_text(folder / (name + ".json")));
  }
  json data_of(const std::string& name) const {
    const std::string page = read_text(folder / (name + ".html"));
    const std::string start = R"(<script type="application/json" id="data">)";
    const auto from = page.find(start) + start.size();
    return json::parse(page.substr(from, page.find("</script>", from) - from));
  }
};

constexpr std::uint64_t kSeed = 4;

TEST_F(ExplanationPage, SaysWhatTheJsonSays) {
  campaign("c", {.track = Track::kOne, .size = 2, .effects = {"creep"}, .seed = kSeed});
  const json explanation = explain("c");
  const json page = data_of("c");
  EXPECT_EQ(page["explanation"], explanation);
  EXPECT_EQ(page["made"]["arguments"],
            "tunnelrig explain --db c.db --simulations 99 --json c.json --html c.html");
  ASSERT_EQ(page["effects"].size(), explanation["adopted"].size());
  EXPECT_EQ(page["settings"]["alpha"], 0.02);
  const json& round = page["rounds"][0];
  EXPECT_GE(round["observed"], round["critical"]);
  EXPECT_EQ(round["ranking"][0]["evidence"], round["observed"]);
  EXPECT_GE(round["null_maxima"].size(), 99u);
}

/// Where one effect was found, taking it out must turn the residual before into the residual after.
TEST_F(ExplanationPage, FittedEffectIsWhatLiesBetweenBeforeAndAfter) {
  campaign("c", {.track = Track::kOne, .size = 2, .effects = {"creep"}, .seed = kSeed});
  const json explanation = explain("c");
  ASSERT_EQ(explanation["adopted"].size(), 1u);
  ASSERT_EQ(explanation["adopted"][0]["effect"], "creep");
  ASSERT_TRUE(explanation["unknown"].empty());
  const json page = data_of("c");
  const json& panel = page["panels"][0];
  EXPECT_EQ(panel["covariate"], "time_since_motor_start_s");
  ASSERT_EQ(panel["x"].size(), 4 * page["runs"]["name"].size());
  double fitted2 = 0, missed2 = 0;
  for (std::size_t i = 0; i < panel["x"].size(); ++i) {
    const std::size_t run = panel["run"][i], rotor = panel["channel"][i].get<std::size_t>() - 1;
    const double before = page["runs"]["before"][rotor][run], fitted = panel["fitted"][i];
    EXPECT_NEAR(panel["before"][i].get<double>() - fitted, panel["after"][i], 1e-5);
    fitted2 += fitted * fitted;
    missed2 += std::pow(before - panel["before"][i].get<double>(), 2);
  }
  EXPECT_GT(fitted2, 0);
  EXPECT_LT(missed2, 0.01 * fitted2);  // sessions weigh in the fit, not in the picture
}

TEST_F(ExplanationPage, WhatHasNoNameHasItsBand) {
  campaign("c", {.track = Track::kOutside, .size = 4, .effects = {"humidity_wave"}, .seed = kSeed});
  const json unknown = explain("c")["unknown"];
  ASSERT_EQ(unknown.size(), 1u);
  const json panel = data_of("c")["panels"][0], first = unknown[0]["shape"][0];
  ASSERT_EQ(panel["half"].size(), panel["x"].size());
  std::size_t lowest = 0;
  for (std::size_t i = 0; i < panel["x"].size(); ++i) {
    EXPECT_GT(panel["half"][i], 0);
    if (panel["x"][i] < panel["x"][lowest]) lowest = i;
  }
  const double half = (first[3].get<double>() - first[2].get<double>()) / 2;
  EXPECT_NEAR(panel["half"][lowest], half, 1e-3 * half);
}

TEST_F(ExplanationPage, OpensInABrowser) {
  if (std::system("command -v chromium >/dev/null && command -v node >/dev/null") != 0)
    GTEST_SKIP() << "chromium or node is not installed, so no page was opened";
  campaign("two", {.track = Track::kTwo, .size = 2, .effects = {"creep", "supply_voltage"}, .seed = kSeed});
  campaign("outside", {.track = Track::kOutside, .size = 2, .effects = {"humidity_wave"}, .seed = kSeed});
  campaign("none", {.track = Track::kNone, .seed = kSeed});
  campaign("few", {.track = Track::kNone, .blocks = 4, .runs = 60, .seed = kSeed});
  campaign("confounded", {.track = Track::kConfounded, .size = 2, .seed = kSeed});
  campaign("raw", {.track = Track::kOne,
                   .runs = 60,
                   .size = 4,
                   .effects = {"creep"},
                   .seed = kSeed,
                   .raw = true,
                   .raw_duration_s = 6});
  std::string pages;
  for (const std::string name : {"two", "outside", "none", "few", "confounded", "raw"}) {
    explain(name);
    pages += fmt::format(" '{}'", (folder / (name + ".html")).string());
  }
  EXPECT_FALSE(data_of("raw")["courses"].empty());
  const std::string log = (folder / "log").string();
  const int status = std::system(fmt::format("node '{}' chromium '{}'{} >'{}' 2>&1", TUNNELRIG_OPEN_PAGES,
                                             (folder / "profile").string(), pages, log)
                                     .c_str());
  EXPECT_EQ(status, 0) << read_text(log);
}

// --- effects of one's own ---

constexpr const char* kWave = R"toml([[effects]]
name = "damp_wave"
formula = "F * (1 + a * sin(2 * _pi * relative_humidity / length + phase))"
physics = "a wave in humidity: made up"
covariates = ["relative_humidity"]
parameters = [
  {name = "a", lower = -0.1, upper = 0.1},
  {name = "length", lower = 0.1, upper = 2, grid = [0.2, 0.25, 0.3, 0.35, 0.4, 0.5, 0.7, 1]},
  {name = "phase", unit = "rad", lower = -4, upper = 4, grid = [-1.5, -0.75, 0, 0.75, 1.5]},
]
)toml";

/// The truth is a wave of period 0.35 that no candidate of the program has.
TEST_F(ExplanationPage, AnEffectOfOnesOwnIsFound) {
  campaign("c", {.track = Track::kOutside, .size = 4, .effects = {"humidity_wave"}, .seed = kSeed});
  EXPECT_EQ(explain("c")["verdict"], "unknown");
  write_text(folder / "own.toml", kWave);
  const json found = explain("c", "--effects own.toml");
  EXPECT_EQ(found["verdict"], "explained");
  ASSERT_EQ(found["adopted"].size(), 1u);
  EXPECT_EQ(found["adopted"][0]["effect"], "damp_wave");
  const json& length = found["adopted"][0]["parameters"]["length"];
  EXPECT_LE(length["ci95"][0], 0.35);
  EXPECT_GE(length["ci95"][1], 0.35);
  EXPECT_LT(found["after"]["held_out_rmse"], found["before"]["held_out_rmse"]);
  EXPECT_THAT(run_program(folder.path(), "explain --list --effects own.toml").out, HasSubstr("damp_wave"));
}

TEST_F(ExplanationPage, EffectsOfOnesOwnAreNotStored) {
  campaign("c", {.track = Track::kNone, .blocks = 4, .runs = 60, .seed = kSeed});
  write_text(folder / "own.toml", kWave);
  const ProgramResult refused = run_program(folder.path(), "explain --db c.db --adopt --effects own.toml");
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.error, HasSubstr("docs/effects.md"));
}

}  // namespace
}  // namespace tunnelrig::attribution
