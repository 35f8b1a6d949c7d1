// `tunnelrig fly` through the command line: its JSON, its files, what it refuses.
#include "cli/program.h"
#include "datasets/csv.h"
#include "support/temporary_folder.h"

#include <cmath>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace tunnelrig {
namespace {

using nlohmann::json;
using test::ProgramResult;
using testing::HasSubstr;

/// Two seconds of a small circle, so that a flight takes milliseconds.
constexpr const char* kShort =
    "format = \"tunnelrig-scenario/1\"\nname = \"short\"\n[[segments]]\nkind = \"circle\"\n"
    "centre = [0, 0.65]\nradius_m = 0.1\nrate_rad_s = 1.5\nturns = 0.5\n";

struct Fly : testing::Test {
  test::TemporaryFolder folder;

  Fly() { write_text(folder / "short.toml", kShort); }

  ProgramResult run(const std::string& arguments) const {
    return test::run_program(folder.path(), "fly " + arguments);
  }

  json flown(const std::string& arguments) const {
    const ProgramResult result = run(arguments + " --json f.json");
    EXPECT_EQ(result.code, 0) << arguments << "\n" << result.error;
    return json::parse(read_text(folder / "f.json"));
  }

  std::string refusal(const std::string& arguments) const {
    return refusal_as_it_is(arguments + " --runs 1 --json no.json --out no");
  }
  std::string refusal_as_it_is(const std::string& arguments) const {
    const ProgramResult result = run(arguments);
    EXPECT_EQ(result.code, 2) << arguments;
    EXPECT_EQ(result.out, "") << arguments;
    EXPECT_FALSE(std::filesystem::exists(folder / "no.json")) << arguments;
    EXPECT_FALSE(std::filesystem::exists(folder / "no")) << arguments;
    return result.error;
  }
};

/// The names and types of docs/flight.md, in its order.
void expect_contract(const json& object) {
  EXPECT_EQ(object["format"], "tunnelrig-fly/1");
  for (const char* text : {"tunnel", "scenario", "map"}) EXPECT_TRUE(object.at(text).is_string()) << text;
  EXPECT_TRUE(object.at("seed").is_number_unsigned());
  EXPECT_TRUE(object.at("extrapolated").is_null() || object["extrapolated"].is_string());
  EXPECT_EQ(object.size(), 7U);
  ASSERT_FALSE(object.at("controllers").empty());
  for (const json& one : object["controllers"]) {
    EXPECT_EQ(one.size(), 12U);
    EXPECT_TRUE(one.at("name").is_string());
    for (const char* count : {"runs", "lost", "contacts"})
      EXPECT_TRUE(one.at(count).is_number_integer()) << count;
    for (const char* number :
         {"rms_y_mm", "rms_z_mm", "max_y_mm", "max_z_mm", "estimator_rms_mm", "thrust_saturated_s"}) {
      EXPECT_TRUE(one.at(number).is_number()) << number;
      EXPECT_TRUE(std::isfinite(one.at(number).get<double>())) << number;
    }
    EXPECT_GE(one["max_y_mm"], one["rms_y_mm"]);
    EXPECT_EQ(one.at("ci95_rms_mm").is_null(), one["runs"] == 1) << "one run has no interval";
    if (one["runs"] > 1) {
      ASSERT_EQ(one["ci95_rms_mm"].size(), 2U);
      EXPECT_LT(one["ci95_rms_mm"][0], one["ci95_rms_mm"][1]);
    }
    EXPECT_EQ(one.at("first_contact_s").is_null(), one["contacts"] == 0);
  }
}

TEST_F(Fly, HelpShowsExamplesAndEveryOption) {
  const ProgramResult help = run("--help");
  EXPECT_EQ(help.code, 0);
  for (const char* part : {"Examples: tunnelrig fly", "--map", "--tunnel", "--scenario", "--controllers",
                           "--runs", "--seed", "--json", "--out"})
    EXPECT_THAT(help.out, HasSubstr(part));
}

TEST_F(Fly, JsonIsTheContract) {
  const json object = flown("--scenario short.toml --controllers ibs,ibs-map --runs 3 --seed 9");
  expect_contract(object);
  EXPECT_EQ(object["seed"], 9);
  EXPECT_EQ(object["tunnel"], "1.5");
  EXPECT_EQ(object["scenario"], "short");
  EXPECT_EQ(object["controllers"].size(), 2U);
  EXPECT_EQ(object["controllers"][1]["name"], "ibs-map");
  EXPECT_EQ(object["controllers"][0]["runs"], 3);
}

TEST_F(Fly, SaysThatAFlightWasLost) {
  write_text(folder / "wild.toml",
             "format = \"tunnelrig-gains/1\"\n[indi]\nposition_y = 40\nvelocity_y = 0.5\nposition_z = 80\n"
             "velocity_z = 0.5\nfilter_Hz = 20\nlead_s = 0.6\n");
  const std::string crash =
      "--scenario circle --controllers indi --runs 3 --motor-loss 0.3 --map-scale 5 --gains wild.toml";
  const json one = flown(crash)["controllers"][0];
  ASSERT_GT(one["lost"], 0);
  for (const char* error : {"rms_y_mm", "rms_z_mm", "max_y_mm", "max_z_mm", "ci95_rms_mm"})
    EXPECT_TRUE(one.at(error).is_null()) << error;
  const ProgramResult said = run(crash);
  EXPECT_THAT(said.out, HasSubstr(" of 3 flights lost"));
  EXPECT_THAT(said.error, HasSubstr("--motor-loss without --weak-rotor: it is rotor 1 that lost thrust"));
}

TEST_F(Fly, IsTheSameToTheByteForASeedWhateverTheNumberOfThreads) {
  std::string first;
  for (const char* workers : {"1", "2", "5"}) {
    const std::string options =
        "--scenario short.toml --controllers ibs-do,indi --runs 5 --seed 3 --workers ";
    const ProgramResult result = run(options + workers + " --json f.json");
    ASSERT_EQ(result.code, 0) << result.error;
    const std::string all = result.out + read_text(folder / "f.json");
    if (first.empty()) first = all;
    EXPECT_EQ(all, first) << workers;
  }
  EXPECT_NE(flown("--scenario short.toml --controllers indi --runs 2 --seed 3"),
            flown("--scenario short.toml --controllers indi --runs 2 --seed 4"));
}

TEST_F(Fly, TheWholeProgrammeStandsBesideTheThesis) {
  const ProgramResult result =
      run("--scenario all --runs 1 --controllers ibs,pid-single --position given --json f.json");
  ASSERT_EQ(result.code, 0) << result.error;
  EXPECT_THAT(result.out, HasSubstr("thesis (flown)"));
  EXPECT_THAT(result.out, HasSubstr("touches the wall at 1 s and 5.1 s near (370, 460) mm"));
  const json programme = json::parse(read_text(folder / "f.json"));
  EXPECT_EQ(programme["format"], "tunnelrig-fly-programme/1");
  ASSERT_EQ(programme["scenarios"].size(), 6U);
  for (const json& one : programme["scenarios"]) expect_contract(one);
}

TEST_F(Fly, OutHoldsLogsTablesAndPictures) {
  ASSERT_EQ(run("--scenario short.toml --controllers ibs --runs 2 --out flights").code, 0);
  for (const char* file : {"ibs-residual.csv", "residual-roll.toml", "effects-roll.toml"})
    EXPECT_TRUE(std::filesystem::exists(folder / "flights" / file)) << file;
  const Sheet log = read_csv(folder / "flights/ibs.csv");
  EXPECT_GT(log.rows.size(), 50U);
  EXPECT_EQ(read_csv(folder / "flights/comparison.csv").rows.size(), 1U);
  for (const char* file : {"path.svg", "path.png", "error-y.svg", "error-z.png"})
    EXPECT_GT(std::filesystem::file_size(folder / "flights" / file), 500U) << file;
  EXPECT_NE(read_text(folder / "flights/path.svg").find("vehicle at the start"), std::string::npos);
}

TEST_F(Fly, WhatWasFlownBeforeIntoTheSameFolderGoes) {
  const std::string short_flight = "--scenario short.toml --runs 1 --out flights --controllers ";
  ASSERT_EQ(run(short_flight + "ibs,indi").code, 0);
  write_text(folder / "flights/notes.txt", "mine");
  ASSERT_EQ(run(short_flight + "ibs").code, 0);
  for (const char* gone : {"indi.csv", "indi-residual.csv"})
    EXPECT_FALSE(std::filesystem::exists(folder / "flights" / gone)) << gone;
  for (const char* kept : {"ibs.csv", "notes.txt", "flights.json", "comparison.csv"})
    EXPECT_TRUE(std::filesystem::exists(folder / "flights" / kept)) << kept;
}

TEST_F(Fly, AScenarioFlownInTheTunnelThatItAsksFor) {
  std::string text = kShort;
  text.insert(text.find("[["), "tunnel = \"2.4\"\n");
  write_text(folder / "large.toml", text);
  EXPECT_EQ(flown("--scenario large.toml --controllers ibs --runs 1")["tunnel"], "2.4");
  EXPECT_EQ(flown("--scenario large.toml --tunnel 1.5 --controllers ibs --runs 1")["tunnel"], "1.5");
  const ProgramResult result = run("--scenario large.toml --controllers ibs --runs 1 --out f --json f.json");
  EXPECT_THAT(result.error, HasSubstr("extrapolated"));
  EXPECT_THAT(result.out, HasSubstr("short in the 2.4 tunnel, 1 runs, extrapolated"));
  const auto differs = HasSubstr("the map is of a tunnel of 1.5 x 1.5 m");
  EXPECT_THAT(json::parse(read_text(folder / "f.json"))["extrapolated"].get<std::string>(), differs);
  const json flights = json::parse(read_text(folder / "f/flights.json"));
  EXPECT_THAT(flights["flights"][0]["extrapolated"].get<std::string>(), differs);
  EXPECT_TRUE(flown("--scenario short.toml --controllers ibs --runs 1")["extrapolated"].is_null());
}

/// The report shows what is stored, so it says what `fly` printed.
TEST_F(Fly, StoresByHowMuchControllersDiffer) {
  const ProgramResult result = run("--scenario short.toml --controllers ibs,indi,pid --runs 3 --out f");
  ASSERT_EQ(result.code, 0) << result.error;
  const json controllers = json::parse(read_text(folder / "f/flights.json"))["flights"][0]["controllers"];
  ASSERT_EQ(controllers.size(), 3U);
  for (const json& one : controllers) EXPECT_EQ(one.at("more_than_mm").size(), 2U) << one["name"];
  for (const char* other : {"indi", "pid"}) {
    const json& more = controllers[other == std::string("indi") ? 1 : 2]["more_than_mm"]["ibs"];
    EXPECT_THAT(result.out,
                HasSubstr(fmt::format("{:+.2f} to {:+.2f}", more[0].get<double>(), more[1].get<double>())));
    const json& less = controllers[0]["more_than_mm"][other];
    EXPECT_EQ(less[0].get<double>(), -more[1].get<double>());
  }
}

TEST_F(Fly, WhatIsNoMapIsRefused) {
  EXPECT_THAT(refusal("--map none.json"), HasSubstr("none.json"));
  write_text(folder / "m.json", "{\"format\": \"something/1\"}");
  EXPECT_THAT(refusal("--map m.json"), HasSubstr("m.json"));
  write_text(folder / "m.json", "y,z\n1,2\n");
  EXPECT_THAT(refusal("--map m.json"), HasSubstr("m.json"));
}

TEST_F(Fly, ImpossibleScenariosAreRefused) {
  const auto scenario = [&](const std::string& centre) {
    std::string text = kShort;
    text.replace(text.find("[0, 0.65]"), 9, centre);
    write_text(folder / "s.toml", text);
    return refusal("--scenario s.toml");
  };
  EXPECT_THAT(scenario("[0.3, 0.65]"), HasSubstr("leaves the tunnel at y ="));
  EXPECT_THAT(scenario("[0.45, 0.65]"), HasSubstr("starts inside a wall at y = 0.450 m"));
  EXPECT_THAT(scenario("[0, nan]"), HasSubstr("s.toml:5"));
  EXPECT_THAT(refusal("--scenario nowhere"), HasSubstr("no scenario nowhere"));
  EXPECT_THAT(refusal("--scenario all --tunnel 1.5"), HasSubstr("--tunnel does not go with it"));
}

TEST_F(Fly, ATunnelThatTheVehicleDoesNotFitIsRefused) {
  write_text(folder / "narrow.toml", "name = \"narrow\"\nshape = \"square\"\nwidth_m = 0.7\nlength_m = 5\n");
  EXPECT_THAT(refusal("--tunnel narrow.toml --scenario hover"), HasSubstr("0.7"));
  EXPECT_THAT(refusal("--tunnel nowhere"), HasSubstr("nowhere"));
}

TEST_F(Fly, AResultWithoutAPlaceIsRefusedBeforeItIsFlown) {
  for (const char* option : {"--json", "--tune"}) {
    const ProgramResult result = run(std::string("--controllers ibs ") + option + " no/x");
    EXPECT_EQ(result.code, 2) << option;
    EXPECT_EQ(result.out, "") << option;
    EXPECT_THAT(result.error, HasSubstr("no/x: cannot be written: there is no folder no")) << option;
  }
}

TEST_F(Fly, OtherBadOptionsAreRefused) {
  EXPECT_THAT(refusal("--controllers lqr"), HasSubstr("no controller is called 'lqr'; there are ibs,"));
  EXPECT_THAT(refusal("--controllers ibs,indi,ibs"), HasSubstr("ibs is named twice"));
  for (const char* name : {"lqr", "pid-stock"})
    EXPECT_THAT(refusal_as_it_is(std::string("--tune tuned.toml --controllers ") + name), HasSubstr(name));
  EXPECT_FALSE(std::filesystem::exists(folder / "tuned.toml"));
  write_text(folder / "of_two.toml", "format = \"tunnelrig-gains/1\"\n[ibs]\nk1_y = 3\n[pid]\nposz_p = 4\n");
  EXPECT_THAT(refusal_as_it_is("--tune of_two.toml --controllers ibs"),
              HasSubstr("has gains of pid, which are not tuned"));
  EXPECT_THAT(refusal("--position guessed"), HasSubstr("must be lidar, lidar-thesis or given"));
  EXPECT_THAT(refusal("--motor-loss 0.9"), HasSubstr("motor_loss"));
  EXPECT_THAT(refusal("--payload-kg nan"), HasSubstr("--payload-kg nan: a number is required"));
  write_text(folder / "g.toml", "format = \"tunnelrig-gains/1\"\n[ibs]\nk1_y = -3\n");
  EXPECT_THAT(refusal("--gains g.toml"), HasSubstr("g.toml:3: ibs.k1_y must be a number from"));
}

TEST_F(Fly, OptionsThatWouldDoNothingAreRefused) {
  for (const char* option : {"--json f.json", "--out f", "--seed 3", "--motor-loss 0.1", "--runs 2"})
    EXPECT_THAT(refusal_as_it_is(std::string("--tune t.toml --budget 10 --controllers ibs ") + option),
                HasSubstr("does not go with --tune"))
        << option;
  EXPECT_FALSE(std::filesystem::exists(folder / "t.toml"));
  EXPECT_THAT(refusal("--budget 20"), HasSubstr("--budget: is of tuning"));
  EXPECT_THAT(refusal("--weak-rotor 2"), HasSubstr("--weak-rotor: says which rotor"));
  EXPECT_THAT(refusal("--position given --lidar-sigma-mm 20"), HasSubstr("there is no LIDAR"));
  EXPECT_THAT(refusal("--position given --blind-s 1,2"), HasSubstr("there is no LIDAR"));
  EXPECT_THAT(refusal("--blind-s 3,2"), HasSubstr("must be two times, the second one later"));
}

}  // namespace
}  // namespace tunnelrig
