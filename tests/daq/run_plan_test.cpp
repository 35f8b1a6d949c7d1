#include "daq/run_plan.h"

#include "datasets/locations.h"
#include "support/message_of.h"

#include <map>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

using test::message_of;
using testing::HasSubstr;

bool is_tunnel(const std::string& location) { return grid_point(location).has_value(); }

struct ThesisPlan : testing::TestWithParam<std::uint64_t> {
  std::vector<PlannedRun> plan = [] {
    PlanSettings settings = thesis_plan();
    settings.seed = GetParam();
    return make_plan(settings);
  }();
};

TEST_P(ThesisPlan, EveryLocationTenTimesInAtLeastTwoSessions) {
  std::map<std::string, std::set<int>> repeats;
  std::map<std::string, std::set<std::string>> sessions;
  for (const PlannedRun& run : plan) {
    if (run.kind == RunKind::kTare) continue;
    EXPECT_TRUE(repeats[run.location].insert(run.repeat).second)
        << run.location << " repeat " << run.repeat << " twice";
    sessions[run.location].insert(run.session);
  }
  EXPECT_EQ(repeats.size(), 42u + 1u + 10u + 9u);
  for (const auto& [location, seen] : repeats) {
    for (int repeat = 1; repeat <= 10; ++repeat) EXPECT_EQ(seen.count(repeat), 1u) << location;
    if (location != "OT" && location != "OS") {  // the anchors have more
      EXPECT_EQ(seen.size(), 10u) << location;
    }
    EXPECT_GE(sessions[location].size(), 2u) << location;
  }
}

TEST_P(ThesisPlan, SessionsBeginAndEndWithATareAndReturnToTheAnchor) {
  std::map<std::string, std::vector<PlannedRun>> sessions;
  for (const PlannedRun& run : plan) sessions[run.session].push_back(run);
  for (const auto& [name, runs] : sessions) {
    EXPECT_EQ(runs.front().kind, RunKind::kTare) << name;
    EXPECT_EQ(runs.back().kind, RunKind::kTare) << name;
    const bool tunnel = is_tunnel(runs[1].location);
    int since_anchor = 0;
    for (std::size_t i = 1; i + 1 < runs.size(); ++i) {
      EXPECT_EQ(runs[i].kind, RunKind::kThrust);
      EXPECT_EQ(is_tunnel(runs[i].location), tunnel) << name << " mixes tunnel and open space";
      since_anchor = runs[i].location == (tunnel ? "OT" : "OS") ? 0 : since_anchor + 1;
      EXPECT_LE(since_anchor, 6) << name;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, ThesisPlan, testing::Values(1, 2, 3, 12345));

TEST(Plan, IsReproducibleAndSeedsDiffer) {
  PlanSettings settings = thesis_plan();
  const Sheet one = plan_sheet(make_plan(settings)), same = plan_sheet(make_plan(settings));
  settings.seed = 2;
  EXPECT_EQ(format_csv(one), format_csv(same));
  EXPECT_NE(format_csv(one), format_csv(plan_sheet(make_plan(settings))));
}

TEST(Plan, ReadsWhatItWrites) {
  PlanSettings settings;
  settings.tunnel = {{"corner", 0.5, -0.5}, {"H1V1", {}, {}}};
  const auto plan = make_plan(settings);
  const auto read = parse_plan(parse_csv(format_csv(plan_sheet(plan)), "plan.csv"));
  ASSERT_EQ(read.size(), plan.size());
  for (std::size_t i = 0; i < plan.size(); ++i) {
    EXPECT_EQ(read[i].location, plan[i].location);
    EXPECT_EQ(read[i].repeat, plan[i].repeat);
    EXPECT_EQ(read[i].kind, plan[i].kind);
    EXPECT_EQ(read[i].y_norm, plan[i].y_norm);
  }
}

/// A session without a visit has no place for its tares.
TEST(Plan, VisitsThatOutgrowASessionAreRefused) {
  PlanSettings settings;
  settings.tunnel = {{"OT", {}, {}}};
  settings.repeats = 100;
  EXPECT_THAT(message_of([&] { make_plan(settings); }),
              HasSubstr("--runs-per-session 40: a visit to a location is 50 runs in a row (--repeats 100, "
                        "--visits 2)"));
  for (settings.repeats = 2; settings.repeats <= 30; ++settings.repeats)
    for (settings.visits = 2; settings.visits <= settings.repeats; ++settings.visits)
      for (settings.runs_per_session = 4; settings.runs_per_session < 20; ++settings.runs_per_session) {
        if (settings.repeats > settings.visits * settings.runs_per_session) continue;
        std::set<std::string> visited;
        const auto plan = make_plan(settings);
        for (const PlannedRun& run : plan) visited.insert(run.session);
        EXPECT_EQ(visited.size(), static_cast<std::size_t>(settings.visits));
      }
}

TEST(Plan, DurationsAreThoseThatLogTakes) {
  PlanSettings settings = thesis_plan();
  settings.duration_s = 2e5;
  EXPECT_THAT(message_of([&] { make_plan(settings); }), HasSubstr("--duration 200000: seconds, above 0"));
}

TEST(Plan, NamesWhatIsWrong) {
  const auto refuse = [](const std::string& csv) {
    return message_of([&] { parse_plan(parse_csv(csv, "plan.csv")); });
  };
  EXPECT_THAT(refuse("session,location\n"), HasSubstr("the required column repeat is missing"));
  EXPECT_THAT(refuse("session,location,repeat\n"), HasSubstr("plans no run"));
  EXPECT_THAT(refuse("session,location,repeat\nS1,OT,1\nS1,OT,1\n"),
              HasSubstr("plan.csv:3: session S1, thrust OT, repeat 1 is planned twice"));
  EXPECT_THAT(refuse("session,location,repeat,kind\nS1,OT,1,fly\n"),
              HasSubstr("'fly' is neither thrust nor tare"));
  EXPECT_THAT(refuse("session,location,repeat,duration_s\nS1,OT,1,-5\n"), HasSubstr("-5 s is no duration"));
  PlanSettings one_visit = thesis_plan();
  one_visit.visits = 1;
  EXPECT_THAT(message_of([&] { make_plan(one_visit); }), HasSubstr("--visits 1"));
  EXPECT_THAT(message_of([] { parse_locations(parse_csv("location,y_norm\nX,0.5\n", "l.csv")); }),
              HasSubstr("one of y_norm and z_norm"));
  EXPECT_THAT(message_of([] { parse_locations(parse_csv("location\nOT\nH4V-2\nOT\n", "l.csv")); }),
              HasSubstr("l.csv:4: column location: 'OT' is a location of line 2 already"));
  EXPECT_THAT(message_of([] { parse_locations(parse_csv("location\nOT\nH0V0\n", "l.csv")); }),
              HasSubstr("l.csv:3: column location: 'H0V0' is a location of line 2 already"))
      << "one place by two names";
}

/// What no run sheet can hold would make the whole campaign file unreadable.
TEST(Plan, CoordinatesAreThoseThatARunSheetCanHold) {
  for (const char* row : {"5,0.5", "0.5,-1.2"}) {
    const std::string csv = fmt::format("session,location,repeat,y_norm,z_norm\nS1,far,1,{}\n", row);
    EXPECT_THAT(message_of([&] { parse_plan(parse_csv(csv, "plan.csv")); }),
                HasSubstr("normalised tunnel coordinates lie between -1 and 1"));
    EXPECT_THAT(message_of([&] {
                  parse_locations(parse_csv(fmt::format("location,y_norm,z_norm\nfar,{}\n", row), "l.csv"));
                }),
                HasSubstr("normalised tunnel coordinates lie between -1 and 1"));
  }
  for (const char* row : {"0.5,", ",0.5"}) {
    const std::string csv = fmt::format("session,location,repeat,y_norm,z_norm\nS1,half,1,{}\n", row);
    EXPECT_THAT(message_of([&] { parse_plan(parse_csv(csv, "plan.csv")); }),
                HasSubstr("plan.csv:2: one of y_norm and z_norm is missing"));
  }
}

TEST(Plan, ColumnsOfItsOwnAreTheRuns) {
  const Sheet sheet = parse_csv(
      "session,location,repeat,Kind,grille_percent,,speed_rpm,note,later\nS1,OT,1,tare,3,0,5000,windy,NaN\n"
      "S1,OT,2,tare,,1,5000,,NaN\n",
      "plan.csv");
  const auto plan = parse_plan(sheet);
  using Own = std::vector<std::pair<std::string, std::string>>;
  EXPECT_EQ(plan[0].own, (Own{{"Kind", "tare"}, {"grille_percent", "3"}, {"note", "windy"}, {"later", ""}}));
  EXPECT_EQ(plan[1].own, (Own{{"Kind", "tare"}, {"grille_percent", ""}, {"note", ""}, {"later", ""}}));
  EXPECT_THAT(plan_doubts(sheet),
              testing::ElementsAre(HasSubstr("plan.csv:1: not stored: speed_rpm;"),
                                   HasSubstr("column 'Kind' is kept as the runs' own; is 'kind' meant?"),
                                   HasSubstr("a column without a name")));
  EXPECT_THAT(plan_doubts(plan_sheet(plan)), testing::IsEmpty());
  const auto refuse = [](const std::string& column, const std::string& cell) {
    const std::string csv = "session,location,repeat," + column + "\nS1,OT,1," + cell + "\n";
    return message_of([&] { parse_plan(parse_csv(csv, "plan.csv")); });
  };
  EXPECT_THAT(refuse("tunnel_airspeed_m_s", "900"), HasSubstr("plan.csv:2: column tunnel_airspeed_m_s: 900"));
  EXPECT_THAT(refuse("air_pressure_hPa", "990"), HasSubstr("this quantity is read as air_pressure_Pa"));
}

}  // namespace
}  // namespace tunnelrig
