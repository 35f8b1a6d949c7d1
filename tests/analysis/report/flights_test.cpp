// Which controller the report calls the best, and which others its runs cannot tell from that one.
#include "analysis/report/report_data.h"
#include "campaigns.h"
#include "datasets/csv.h"
#include "datasets/error.h"
#include "support/temporary_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace tunnelrig {
namespace {

using Json = nlohmann::ordered_json;

/// One flight of three controllers: rms of y and z, contacts, interval.
Json flight(const std::string& scenario, const std::vector<std::tuple<std::string, double, int>>& flown) {
  const Json path{{"time_s", {0, 0.1}}, {"y_m", {0, 0}}, {"z_m", {0.75, 0.75}}};
  Json json{{"tunnel", "1.5"},     {"scenario", scenario},      {"map", "m.json"},
            {"position", "lidar"}, {"walls", {{0, 0}, {1, 0}}}, {"reference", path}};
  for (const auto& [name, rms_mm, contacts] : flown) {
    json["controllers"].push_back({{"name", name},
                                   {"runs", 5},
                                   {"rms_y_mm", 0.6 * rms_mm},
                                   {"rms_z_mm", 0.8 * rms_mm},
                                   {"max_y_mm", 9},
                                   {"max_z_mm", 9},
                                   {"ci95_rms_mm", {rms_mm - 1, rms_mm + 1}},
                                   {"contacts", contacts},
                                   {"estimator_rms_mm", 1},
                                   {"thrust_saturated_s", 0},
                                   {"path", path}});
  }
  return json;
}

struct BestController : testing::Test {
  test::TemporaryFolder folder;
  std::filesystem::path db = folder / "c.db";

  Json best(const std::vector<Json>& flights) const {
    write_text(
        folder / "flights.json",
        Json{{"format", "tunnelrig-flights/1"}, {"command", "tunnelrig fly"}, {"flights", flights}}.dump());
    if (!std::filesystem::exists(db)) test::make_campaign(db, {.raw_data = false});
    const CampaignFile file(db, CampaignFile::Access::kRead);
    const ReportSettings settings{.db = "c.db", .flights = (folder / "flights.json").string()};
    return Json::parse(report_data(file, settings).json)["summary"]["flown"];
  }
};

TEST_F(BestController, TouchesNothingAndErrsLeast) {
  const Json one =
      best({flight("hover", {{"fast", 5, 2}, {"ibs", 10, 0}, {"pid", 11.5, 0}, {"lag", 20, 0}})});
  EXPECT_EQ(one["name"], "ibs") << "a smaller error with contacts is not better";
  EXPECT_NEAR(one["rms_mm"].get<double>(), 10, 1e-9);
  EXPECT_EQ(one["ci95_mm"], Json({9.0, 11.0}));
  EXPECT_EQ(one["as_good"], Json({"pid"})) << "[10.5, 12.5] and [9, 11] overlap";
  EXPECT_EQ(one["controllers"], 4);
}

/// Twenty runs, of which the first `touching` touch a wall.
Json with_runs(Json flight, std::size_t controller, int touching) {
  Json contacts = Json::array();
  for (int run = 0; run < 20; ++run) contacts.push_back(run < touching ? 1 : 0);
  Json& one = flight["controllers"][controller];
  one["runs"] = 20;
  one["contacts_of_runs"] = contacts;
  return flight;
}

TEST_F(BestController, IsToldFromOthersByTheDifferencesThatFlyStored) {
  Json three = flight("hover", {{"a", 10, 0}, {"b", 10.3, 0}, {"c", 10.3, 0}});
  EXPECT_EQ(best({three})["as_good"], Json({"b", "c"}))
      << "of an earlier program: the means' intervals overlap";
  three["controllers"][1]["more_than_mm"] = {{"a", {0.2, 0.4}}, {"c", {-1, 1}}};
  three["controllers"][2]["more_than_mm"] = {{"a", {-0.6, 1.2}}, {"b", {-1, 1}}};
  const Json one = best({three});
  EXPECT_EQ(one["name"], "a");
  EXPECT_EQ(one["as_good"], Json({"c"})) << "b errs 0.3 mm more in almost every run, c in every other";
  for (const Json& unread : {Json("none"), Json{{"a", {0.2}}}, Json{{"a", {0.2, nullptr}}}}) {
    three["controllers"][1]["more_than_mm"] = unread;
    EXPECT_EQ(best({three})["as_good"], Json({"b", "c"})) << unread;
  }
}

TEST_F(BestController, OneContactInTwentyRunsDecidesNothing) {
  const auto two = [&](int touching) {
    const Json pair = flight("hover", {{"near", 5, touching}, {"far", 20, 0}});
    return best({with_runs(with_runs(pair, 0, touching), 1, 0)})["name"];
  };
  EXPECT_EQ(two(1), "near") << "Fisher's p is 1";
  EXPECT_EQ(two(4), "near") << "0.11";
  EXPECT_EQ(two(5), "far") << "0.047";
  EXPECT_EQ(two(20), "far");
  Json broken = with_runs(flight("hover", {{"a", 5, 0}}), 0, 0);
  broken["controllers"][0]["contacts_of_runs"].erase(0);
  EXPECT_THROW(best({broken}), InputError);
}

TEST_F(BestController, HasLostNoFlight) {
  Json crashed = flight("hover", {{"crashed", 1, 0}, {"ibs", 10, 3}});
  Json& one = crashed["controllers"][0];
  one["lost"] = 1;
  for (const char* error : {"rms_y_mm", "rms_z_mm", "max_y_mm", "max_z_mm", "ci95_rms_mm"})
    one[error] = nullptr;
  EXPECT_EQ(best({crashed})["name"], "ibs");
  EXPECT_EQ(best({crashed, flight("circle", {{"crashed", 1, 0}, {"ibs", 10, 0}})})["name"], "ibs");
  crashed["controllers"].erase(1);
  EXPECT_TRUE(best({crashed}).is_null());
}

TEST_F(BestController, IsJudgedOverAllScenarios) {
  const Json both = best({flight("hover", {{"a", 10, 0}, {"b", 20, 0}, {"only", 1, 0}}),
                          flight("circle", {{"a", 40, 0}, {"b", 20, 0}})});
  EXPECT_EQ(both["name"], "b") << "29 mm against 20 mm; what flew once only does not count";
  EXPECT_EQ(both["first_in"], 1);
  EXPECT_EQ(both["scenarios"], 2);
  EXPECT_TRUE(best({flight("hover", {{"a", 10, 0}}), flight("circle", {{"b", 20, 0}})}).is_null());
}

}  // namespace
}  // namespace tunnelrig
