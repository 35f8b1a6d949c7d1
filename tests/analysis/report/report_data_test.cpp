#include "analysis/report/report_data.h"

#include "analysis/maps/tunnel_maps.h"
#include "analysis/reduction_output.h"
#include "analysis/report/render.h"
#include "analysis/table_reduction.h"
#include "campaigns.h"
#include "datasets/csv.h"
#include "datasets/error.h"
#include "datasets/run_marks.h"
#include "support/message_of.h"
#include "support/temporary_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace tunnelrig {
namespace {

using Json = nlohmann::ordered_json;
using test::CampaignParts;
using test::make_campaign;
using test::message_of;
using testing::HasSubstr;

struct ReportTest : testing::Test {
  test::TemporaryFolder folder;
  std::filesystem::path db = folder / "c.db";

  ReportData report(const ModelTerms& terms = {}) const {
    const CampaignFile file(db, CampaignFile::Access::kRead);
    return report_data(file, {.db = "c.db",
                              .program_version = "0",
                              .arguments = "tunnelrig report",
                              .created_utc = "2026-03-02T08:00:00Z",
                              .model = {terms, {}}});
  }
  Json json(const CampaignParts& parts) const {
    make_campaign(db, parts);
    return Json::parse(report().json);
  }
};

struct Reduced {
  CampaignData data;
  Reduction reduction;
  Summary summary;

  explicit Reduced(const std::filesystem::path& db)
      : data(read_campaign_data(CampaignFile(db, CampaignFile::Access::kRead))),
        reduction(reduce_runs(data, {})),
        summary(summarize_locations(data, reduction)) {}
};

TEST_F(ReportTest, NumbersAreThoseOfTheReduction) {
  const Json page = json({});
  const Reduced expected(db);
  Json locations =
      Json::parse(reduction_json(expected.data, expected.reduction, expected.summary, Convention::kThesis));
  locations["area"] = "one propeller disc";
  EXPECT_EQ(page["sections"]["locations"], locations);
  ASSERT_EQ(page["runs"]["run"].size(), expected.data.runs.size());
  for (const RunCoefficients& run : expected.reduction.runs) {
    EXPECT_EQ(page["runs"]["run"][run.run], expected.data.runs[run.run].run);
    EXPECT_EQ(page["runs"]["c_t"][run.run].get<double>(), run.c_t);
    EXPECT_EQ(page["runs"]["u_percent"][run.run].get<double>(), run.u_percent);
  }
  for (const LocationSummary& location : expected.summary.locations) {
    if (location.label != "OT") continue;
    EXPECT_EQ(page["summary"]["c_t"][0]["value"].get<double>(), location.c_t.mean);
    EXPECT_EQ(page["summary"]["c_t"][0]["u95"].get<double>(), location.c_t.u95);
  }
}

TEST_F(ReportTest, MapsAreThoseOfTheFit) {
  const Json page = json({});
  const Reduced expected(db);
  const TunnelMaps maps = fit_maps(map_input(expected.data, expected.summary, "c.db"));
  const Json& section = page["sections"]["maps"];
  const auto nodes = static_cast<int>(section["y_norm"].size());
  const DisturbanceMap map = disturbance_map(maps, nodes, "{}");
  EXPECT_EQ(section["y_norm"].get<std::vector<double>>(), map.grid.y_norm);
  EXPECT_EQ(section["delta_ct"]["value_percent"].get<std::vector<double>>(), map.delta_ct.value_percent);
  EXPECT_EQ(section["delta_ct"]["u95_percent"].get<std::vector<double>>(), map.delta_ct.u95_percent);
  EXPECT_EQ(section["uneven_thrust"]["value_percent"].get<std::vector<double>>(),
            map.uneven_thrust.value_percent);
  ASSERT_TRUE(map.uneven_thrust_fit.offset);
  EXPECT_EQ(section["uneven_thrust"]["offset"], Json::array({map.uneven_thrust_fit.offset->value_percent,
                                                             map.uneven_thrust_fit.offset->u95_percent}));
  EXPECT_FALSE(section["delta_ct"].contains("offset"));
  double greatest = 0;
  for (const MeasuredLocation& location : map.locations)
    greatest = std::max(greatest, location.delta_ct_percent);
  EXPECT_EQ(page["summary"]["greatest_delta_ct_percent"]["value"].get<double>(), greatest);
}

TEST_F(ReportTest, CalibrationIsTheCertificates) {
  const Json page = json({});
  const Reduced expected(db);
  const Json& section = page["sections"]["calibration"];
  EXPECT_EQ(section["points_hash"], expected.data.certificate->points_hash);
  EXPECT_EQ(section["passed"], expected.data.certificate->passed());
  ASSERT_EQ(section["cells"].size(), 4u);
  for (std::size_t cell = 0; cell < 4; ++cell) {
    const CellFit& fit = expected.data.certificate->cells[cell];
    EXPECT_EQ(section["cells"][cell]["gain_V_per_N"].get<double>(), fit.gain_V_per_N);
    for (std::size_t i = 0; i < fit.points.size(); ++i)
      EXPECT_EQ(section["cells"][cell]["residual_N"][i].get<double>(), fit.points[i].residual_N);
  }
  EXPECT_EQ(page["sections"]["provenance"][0]["arguments"], "tunnelrig calibrate");
}

TEST_F(ReportTest, RunsCarryTheirHealth) {
  const Json page = json({.frames_lost = 25});
  const Json& runs = page["runs"];
  EXPECT_EQ(runs["lost"][0], 25);
  EXPECT_EQ(runs["frames"][0], 2525);
  EXPECT_EQ(page["summary"]["frames_lost"], 25);
  EXPECT_NEAR(runs["shaft_rpm"][0].get<double>(), 5000, 5);
  EXPECT_EQ(runs["clipped"][0], 0);
  EXPECT_THAT(runs["hash"][0].get<std::string>(), testing::StartsWith("xxh3:"));
  EXPECT_EQ(runs["tare"].back(), 1);
  EXPECT_TRUE(runs["c_t"].back().is_null());
  EXPECT_TRUE(runs["shaft_rpm"].back().is_null());
  EXPECT_EQ(page["sections"]["tares"]["readings"].size(), 4u);
  EXPECT_FALSE(page["sections"]["findings"].empty());
}

TEST_F(ReportTest, ATareThatDoesNotCountIsNoZero) {
  make_campaign(db, {});
  {
    CampaignFile file(db, CampaignFile::Access::kWrite);
    exclude_run(file, file.runs().back().run, "the motors were running");
  }
  EXPECT_EQ(Json::parse(report().json)["sections"]["tares"]["readings"].size(), 3u) << "of four";
}

TEST_F(ReportTest, PlanesStandAtTheirDistance) {
  const Json page = json({});
  const Json& planes = page["sections"]["open_space"]["planes"];
  EXPECT_EQ(page["sections"]["open_space"]["open_space"], "OS");
  ASSERT_EQ(planes.size(), 6u);
  const double radius_m = 0.1524, height_m = 1.5, vehicle_m = 0.3;
  for (const Json& plane : planes) {
    const double distance_m = plane["distance_R"].get<double>() * radius_m;
    const double z_m = plane["z_norm"].get<double>() * (height_m - vehicle_m) / 2;  // (4.2)
    EXPECT_NEAR(distance_m, plane["side"] == "ground" ? z_m + height_m / 2 : height_m / 2 - z_m, 1e-12);
  }
}

TEST_F(ReportTest, SaysWhereRunsComeFrom) {
  const auto origins = [&](const std::string& source) {
    std::filesystem::remove(db);
    std::filesystem::remove_all(folder / "c.db.folder");
    return json({.raw_data = false,
                 .open_space = false,
                 .columns = 1,
                 .rows = 1,
                 .source = source})["summary"]["origins"];
  };
  EXPECT_EQ(origins("virtual"), Json({{"simulated", 2}, {"measured", 0}, {"unknown", 0}}));
  EXPECT_EQ(origins("serial:/dev/ttyACM0"), Json({{"simulated", 0}, {"measured", 2}, {"unknown", 0}}));
  EXPECT_EQ(origins(""), Json({{"simulated", 0}, {"measured", 0}, {"unknown", 2}}));
}

/// A campaign that lacks something, the sections that it therefore has not, and a word of the reason.
struct Lacking {
  const char* name;
  CampaignParts parts;
  std::map<std::string, std::string> absent;
};

std::ostream& operator<<(std::ostream& out, const Lacking& lacking) { return out << lacking.name; }

struct LackingTest : ReportTest, testing::WithParamInterface<Lacking> {};

TEST_P(LackingTest, SaysWhyASectionIsNotThere) {
  make_campaign(db, GetParam().parts);
  const ReportData data = report();
  std::map<std::string, std::string> absent;
  for (const AbsentSection& section : data.absent) absent.emplace(section.section, section.reason);
  for (const auto& [section, word] : GetParam().absent)
    EXPECT_THAT(absent[section], HasSubstr(word)) << section;
  for (const auto& [section, reason] : absent) {
    EXPECT_TRUE(GetParam().absent.contains(section)) << section << ": " << reason;
    EXPECT_EQ(Json::parse(data.json)["sections"][section]["absent"], reason);
  }
  EXPECT_THAT(render_report(data.json), HasSubstr("tunnelrig-report/1"));
}

const std::string kNotCalibrated = "no calibration yet", kGiven = "thrusts, not";
INSTANTIATE_TEST_SUITE_P(
    Report, LackingTest,
    testing::Values(Lacking{"Nothing", {}, {}},
                    Lacking{"Calibration",
                            {.calibrated = false},
                            {{"maps", kNotCalibrated},
                             {"locations", kNotCalibrated},
                             {"open_space", kNotCalibrated},
                             {"uneven", kNotCalibrated},
                             {"budget", kNotCalibrated},
                             {"calibration", "`tunnelrig calibrate`"}}},
                    Lacking{"Tunnel", {.tunnel = false}, {{"maps", "no [tunnel]"}}},
                    Lacking{"Locations", {.columns = 1, .rows = 2}, {{"maps", "at least 4 are needed"}}},
                    Lacking{"OpenSpace", {.open_space = false}, {{"open_space", "no runs in open space"}}},
                    Lacking{"Walls",
                            {.raw_data = false,
                             .open_space = false,
                             .columns = 0,
                             .rows = 0,
                             .odd_label = "OS",
                             .repeats = 1},
                            {{"maps", "no map"},
                             {"open_space", "no runs in a tunnel or near a plane"},
                             {"budget", "no run was repeated"},
                             {"calibration", kGiven},
                             {"health", kGiven},
                             {"tares", kGiven}}},
                    Lacking{"Tares", {.tares = false}, {{"tares", "No session has a tare"}}},
                    Lacking{"RawData",
                            {.raw_data = false},
                            {{"calibration", kGiven}, {"health", kGiven}, {"tares", kGiven}}},
                    Lacking{"Rotors",
                            {.raw_data = false, .rotors = 1},
                            {{"maps", "needs four rotors"},
                             {"uneven", "1 rotor."},
                             {"calibration", kGiven},
                             {"health", kGiven},
                             {"tares", kGiven}}}),
    [](const auto& lacking) { return std::string("Lacks") + lacking.param.name; });

TEST_F(ReportTest, ATermWithoutItsMeasurementIsAReason) {
  make_campaign(db, {});
  const ReportData data = report({.air_pressure = true});
  ASSERT_FALSE(data.absent.empty());
  EXPECT_THAT(data.absent[0].reason, HasSubstr("has no air_pressure_Pa"));
}

TEST_F(ReportTest, AdoptedModelsComeWithTheirExplanations) {
  EXPECT_FALSE(json({.raw_data = false})["sections"].contains("model"));
  {
    CampaignFile file(db, CampaignFile::Access::kWrite);
    for (const char* verdict : {"explained", "confounded"})
      file.add_document("model", {"0", "tunnelrig explain --adopt", "{}"},
                        Json{{"explanation", test::explanation(verdict)}}.dump());
  }
  const Json models = Json::parse(report().json)["sections"]["model"];
  ASSERT_EQ(models.size(), 2u);
  EXPECT_EQ(models[0]["version"], 2);
  EXPECT_EQ(models[0]["arguments"], "tunnelrig explain --adopt");
  EXPECT_EQ(models[0]["explanation"], test::explanation("confounded"));
  EXPECT_EQ(models[1]["explanation"]["verdict"], "explained");
}

TEST_F(ReportTest, TheSummarySaysWhereAndWhatIsMissing) {
  const Json summary = json({})["summary"];
  const Reduced expected(db);
  const DisturbanceMap map =
      disturbance_map(fit_maps(map_input(expected.data, expected.summary, "c.db")), 41, "{}");
  for (const auto& [key, sign] :
       {std::pair{"greatest_delta_ct_percent", 1}, {"least_delta_ct_percent", -1}}) {
    const MeasuredLocation* most = &map.locations[0];
    for (const MeasuredLocation& location : map.locations)
      if (sign * location.delta_ct_percent > sign * most->delta_ct_percent) most = &location;
    EXPECT_EQ(summary[key]["location"], most->label);
    EXPECT_EQ(summary[key]["value"].get<double>(), most->delta_ct_percent);
    EXPECT_EQ(summary[key]["u95"].get<double>(), most->delta_ct_u95_percent);
    EXPECT_EQ(summary[key]["y_norm"].get<double>(), most->y_norm);
    EXPECT_EQ(summary[key]["z_norm"].get<double>(), most->z_norm);
  }
  EXPECT_TRUE(summary["greatest_uneven_percent"].contains("y_norm"));
  ASSERT_EQ(summary["missing"].size(), 2u);
  EXPECT_THAT(summary["missing"][0].get<std::string>(), HasSubstr("explain --adopt"));
  EXPECT_THAT(summary["missing"][1].get<std::string>(), HasSubstr("--flights"));
}

/// The field's greatest U here is a negative one: of the values as measured an offset makes the greatest
/// where the field is least.
TEST_F(ReportTest, TheGreatestUIsTheFieldsAndNotTheRigs) {
  const Json uneven = json({.uneven_offset_percent = 5})["summary"]["greatest_uneven_percent"];
  EXPECT_NEAR(uneven["offset"].get<double>(), 5, 0.3);
  EXPECT_GT(uneven["offset_u95"].get<double>(), 0);
  EXPECT_NEAR(uneven["value"].get<double>() + uneven["offset"].get<double>(),
              uneven["as_measured"].get<double>(), 1e-4);
  double greatest = 0;
  const Reduced expected(db);
  for (const LocationSummary& location : expected.summary.locations) {
    if (location.y_norm.value_or(0) == 0) continue;
    greatest = std::max(greatest, std::abs(location.u_percent.mean - uneven["offset"].get<double>()));
  }
  EXPECT_NEAR(std::abs(uneven["value"].get<double>()), greatest, 1e-4);
  EXPECT_LT(uneven["value"].get<double>(), 0);
  EXPECT_NE(uneven["y_norm"].get<double>(), 0);
  const TunnelMaps maps = fit_maps(map_input(expected.data, expected.summary, "c.db"));
  for (const MeasuredField& measured : measured_field(maps.uneven_thrust)) {
    if (measured.label == uneven["location"]) {
      EXPECT_NEAR(uneven["u95"].get<double>(), measured.field.u95(), 1e-9);
    }
  }
}

TEST_F(ReportTest, WithoutAMapTheGreatestUIsOffTheMiddlePlaneAndAsMeasured) {
  const Json summary = json({.tunnel = false, .uneven_offset_percent = 5})["summary"];
  const Json& uneven = summary["greatest_uneven_percent"];
  EXPECT_FALSE(uneven.contains("offset"));
  EXPECT_EQ(uneven["value"], uneven["as_measured"]);
}

TEST_F(ReportTest, TheSummarySaysWhatIsMissingOfAPartialCampaign) {
  const Json none = json({.calibrated = false})["summary"];
  EXPECT_THAT(none["missing"][0].get<std::string>(), HasSubstr("There are no coefficients"));
  std::filesystem::remove(db);
  std::filesystem::remove_all(folder / "c.db.folder");
  const Json unmapped = json({.raw_data = false, .rotors = 1})["summary"];
  EXPECT_THAT(unmapped["missing"][0].get<std::string>(), HasSubstr("no maximum of ΔC_T"));
  EXPECT_THAT(unmapped["missing"][1].get<std::string>(), HasSubstr("no uneven thrust"));
}

TEST_F(ReportTest, TheSummaryHasTheModelInForce) {
  make_campaign(db, {.raw_data = false});
  const ModelVersion version = test::adopted_model();
  const CampaignFile file(db, CampaignFile::Access::kRead);
  const Json page = Json::parse(report_data(file, {.db = "c.db", .model = {{}, version}}).json);
  const Json& model = page["summary"]["model"];
  EXPECT_EQ(model["effects"], Json(version.effects()));
  EXPECT_EQ(model["before"], test::explanation("explained")["before"]);
  EXPECT_EQ(model["after"], test::explanation("explained")["after"]);
  EXPECT_EQ(model["unit"], "N");
}

TEST_F(ReportTest, NothingToReportIsRefused) {
  CampaignFile file(db, CampaignFile::Access::kRecord);
  EXPECT_THAT(message_of([&] { report(); }), HasSubstr("neither a campaign nor a table"));
  file.set_text("campaign.toml", reference_campaign_toml());
  EXPECT_THAT(message_of([&] { report(); }), HasSubstr("no runs and no calibration yet"));
}

TEST_F(ReportTest, TablesAreReducedByGroup) {
  test::make_table(db);
  const Json page = Json::parse(report().json);
  EXPECT_EQ(page["kind"], "table");
  const Json& groups = page["sections"]["table"]["groups"];
  ASSERT_EQ(groups.size(), 2u);
  EXPECT_EQ(groups[0]["group"], "<i>thin</i>");
  EXPECT_EQ(groups[0]["speed_rpm"], Json({3000.0, 4000.0, 5000.0, 6000.0}));
  const CampaignFile file(db, CampaignFile::Access::kRead);
  const TableReduction expected = reduce_table_rows(observations_of(file), Convention::kPropeller);
  for (std::size_t i = 0; i < 4; ++i)
    EXPECT_EQ(groups[1]["c_t"][i].get<double>(), expected.rows[expected.groups[1].rows[i]].c_t);
}

TEST_F(ReportTest, ATableWithoutThrustSaysSo) {
  test::make_table(db, false);
  const ReportData data = report();
  ASSERT_EQ(data.absent.size(), 1u);
  EXPECT_THAT(data.absent[0].reason, HasSubstr("no thrust"));
}

}  // namespace
}  // namespace tunnelrig
