// The paper's figures: drawn by gnuplot for real, of the width asked for, of the reduction's numbers.
#include "analysis/report/figures/figures.h"

#include "analysis/report/figures/write_figures.h"
#include "campaigns.h"
#include "datasets/csv.h"
#include "support/message_of.h"
#include "support/occurrences.h"
#include "support/temporary_folder.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <set>
#include <sstream>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace tunnelrig {
namespace {

using test::message_of;
using test::occurrences;
using testing::HasSubstr;
using testing::Not;

double big_endian(std::string_view bytes) {
  double value = 0;
  for (const char byte : bytes.substr(0, 4)) value = 256 * value + static_cast<unsigned char>(byte);
  return value;
}

/// The rows of a data block of a gnuplot script.
std::vector<std::vector<double>> block(const std::string& script, const std::string& name) {
  const std::string start = "$" + name + " << END\n";
  const auto from = script.find(start);
  std::istringstream lines(from == std::string::npos ? "END" : script.substr(from + start.size()));
  std::vector<std::vector<double>> rows;
  for (std::string line; std::getline(lines, line) && line != "END";) {
    std::istringstream numbers(line);
    rows.emplace_back();
    for (std::string number; numbers >> number;) rows.back().push_back(std::stod(number));
  }
  return rows;
}

/// A controller whose name would end a quoted text, run a command, and end a block of data.
constexpr const char* kHostileFlights =
    R"({"format": "tunnelrig-flights/1", "command": "tunnelrig fly",
  "flights": [{"tunnel": "1.5", "scenario": "hover", "map": "m.json", "position": "lidar",
    "walls": [[-0.75, 0], [0.75, 0], [0.75, 1.5], [-0.75, 1.5]],
    "reference": {"time_s": [0, 0.1], "y_m": [0, 0], "z_m": [0.75, 0.75]},
    "controllers": [{"name": "it's `touch owned`\n';system('touch owned')\nEND", "runs": 2, "rms_y_mm": 3, "rms_z_mm": 4,
      "max_y_mm": 9, "max_z_mm": 8, "ci95_rms_mm": [4.5, 5.5], "contacts": 0, "first_contact_s": null,
      "estimator_rms_mm": 1.5, "thrust_saturated_s": 0, "path": {"y_m": [0, 0.01], "z_m": [0.75, 0.76]}},
     {"name": "lag", "runs": 2, "rms_y_mm": 30, "rms_z_mm": 40,
      "max_y_mm": 9, "max_z_mm": 8, "contacts": 3, "first_contact_s": 1,
      "estimator_rms_mm": 1.5, "thrust_saturated_s": 0, "path": {"y_m": [0, 0.03], "z_m": [0.75, 0.79]}}]}]})";

const std::set<std::string> kCampaignFigures = {
    "delta_ct",        "delta_ct_u95",       "uneven_thrust", "uneven_thrust_u95",
    "c_t_by_location", "uneven_by_location", "open_space",    "calibration_residuals"};

struct FiguresTest : testing::Test {
  test::TemporaryFolder folder;
  std::filesystem::path db = folder / "c.db", out = folder / "fig";

  ReportSettings settings() const { return {.db = "c.db", .program_version = "0"}; }
  WrittenFigures write(const ReportSettings& report, const FigureSettings& figures = {}) const {
    return write_figures(out, CampaignFile(db, CampaignFile::Access::kRead), report, figures);
  }
};

struct DrawnFiguresTest : FiguresTest {
  void SetUp() override {
    if (std::system("gnuplot --version > /dev/null 2>&1") != 0)
      GTEST_SKIP() << "gnuplot is not installed, so no figure was drawn";
  }
};

std::set<std::string> stems(const std::vector<std::filesystem::path>& files) {
  std::set<std::string> names;
  for (const auto& file : files) names.insert(file.stem());
  return names;
}

double width_mm_of(const std::string& text, FigureFormat format) {
  if (format == FigureFormat::kPdf) {
    double left = 0, bottom = 0, right = 0;
    std::istringstream box(text.substr(text.find("/MediaBox [") + 11));
    box >> left >> bottom >> right;
    return (right - left) / 72 * 25.4;
  }
  if (format == FigureFormat::kSvg) return std::stod(text.substr(text.find(" width=\"") + 8));
  const double dots_per_metre = big_endian(text.substr(text.find("pHYs") + 4));
  return big_endian(text.substr(16)) / dots_per_metre * 1e3;
}

void expect_embedded_fonts(const std::string& pdf, const std::filesystem::path& file) {
  const std::size_t fonts = occurrences(pdf, "/Type /FontDescriptor");
  EXPECT_GT(fonts, 0u) << file;
  EXPECT_EQ(occurrences(pdf, "/FontFile"), fonts) << file;
}

/// Every text is in the family that the style element brings along.
void expect_embedded_font(const std::string& svg, const std::filesystem::path& file) {
  const std::string start = "@font-face { font-family: \"";
  const auto family_at = svg.find(start);
  ASSERT_NE(family_at, std::string::npos) << file;
  const auto from = family_at + start.size();
  const std::string family = svg.substr(from, svg.find('"', from) - from);
  EXPECT_GT(occurrences(svg, "<text"), 0u) << file;
  EXPECT_EQ(occurrences(svg, "font-family=\""), occurrences(svg, "font-family=\"" + family + "\"")) << file;
  // TrueType or CFF by the first four bytes, and more than the tables alone.
  const std::string data = "url(data:font/ttf;base64,";
  const auto font_at = svg.find(data) + data.size();
  EXPECT_THAT(svg.substr(font_at, 5), testing::AnyOf("AAEAA", "T1RUT")) << file;
  EXPECT_GT(svg.find(')', font_at) - font_at, 10000u) << file;
}

/// 600 an inch, said in the chunk behind the header, whose sum another program checks.
void expect_dots(const std::string& png, const std::filesystem::path& file) {
  EXPECT_EQ(big_endian(png.substr(16)), std::round(84 / 25.4 * kFigureDotsPerInch)) << file;
  EXPECT_EQ(png.substr(33 + 4, 4), "pHYs") << file;
  EXPECT_EQ(big_endian(png.substr(33 + 8)), 23622) << file;
  EXPECT_EQ(png[33 + 16], '\1') << "a metre is the unit";
  if (std::system("python3 -c pass 2> /dev/null") != 0) return;
  const std::string check = fmt::format(
      "python3 -c \"import zlib, sys; d=open('{}','rb').read(); "
      "sys.exit(zlib.crc32(d[37:50]) != int.from_bytes(d[50:54],'big'))\"",
      file.string());
  EXPECT_EQ(std::system(check.c_str()), 0) << file;
}

TEST_F(DrawnFiguresTest, EveryFormatHasTheWidthAskedForAndAllFigures) {
  test::make_campaign(db, {.frames_lost = 3});
  const std::vector<std::pair<FigureFormat, double>> requests = {{FigureFormat::kPdf, 84},
                                                                 {FigureFormat::kPdf, 174},
                                                                 {FigureFormat::kSvg, 60},
                                                                 {FigureFormat::kPng, 84}};
  for (const auto& [format, width_mm] : requests) {
    const WrittenFigures written = write(settings(), {.format = format, .width_mm = width_mm});
    std::set<std::string> expected = kCampaignFigures;
    expected.insert("captions");
    EXPECT_EQ(stems(written.files), expected);
    for (const auto& file : written.files) {
      if (file.extension() == ".md") continue;
      const std::string text = read_text(file);
      EXPECT_NEAR(width_mm_of(text, format), width_mm, 0.2) << file;
      EXPECT_GT(text.size(), 3000u) << file;
      if (format == FigureFormat::kPdf) expect_embedded_fonts(text, file);
      if (format == FigureFormat::kSvg) expect_embedded_font(text, file);
      if (format == FigureFormat::kPng) expect_dots(text, file);
    }
  }
}

TEST_F(DrawnFiguresTest, ModelsAndFlightsHaveFiguresWhereThereAreSome) {
  test::make_campaign(db, {.odd_label = "it's `touch owned`"});
  write_text(folder / "flights.json", kHostileFlights);
  ReportSettings report = settings();
  report.model.version = test::adopted_model();
  report.flights = (folder / "flights.json").string();
  const WrittenFigures written = write(report, {.command = "tunnelrig report --figures fig"});
  std::set<std::string> expected = kCampaignFigures;
  expected.insert({"residual_before_after", "flight_1_paths", "flight_1_errors", "captions"});
  EXPECT_EQ(stems(written.files), expected);
  EXPECT_TRUE(written.absent.empty());
  EXPECT_FALSE(std::filesystem::exists(out / "owned"));
  const std::string captions = read_text(out / "captions.md");
  EXPECT_THAT(captions, HasSubstr("    tunnelrig report --figures fig\n"));
  for (const std::string& name : expected) {
    if (name != "captions") {
      EXPECT_THAT(captions, HasSubstr("**" + name + ".pdf**"));
    }
  }
}

TEST_F(DrawnFiguresTest, ControllersThatAllLostAFlightAreNamed) {
  test::make_campaign(db, {.raw_data = false, .columns = 1, .rows = 1});
  nlohmann::json flights = nlohmann::json::parse(kHostileFlights);
  for (nlohmann::json& controller : flights["flights"][0]["controllers"]) {
    controller["lost"] = 1;
    for (const char* error : {"rms_y_mm", "rms_z_mm", "max_y_mm", "max_z_mm", "ci95_rms_mm"})
      controller[error] = nullptr;
  }
  write_text(folder / "flights.json", flights.dump());
  ReportSettings report = settings();
  report.flights = (folder / "flights.json").string();
  EXPECT_TRUE(stems(write(report).files).contains("flight_1_errors"));
  EXPECT_GT(std::filesystem::file_size(out / "flight_1_errors.pdf"), 1000U);
}

TEST_F(DrawnFiguresTest, WhatCannotBeDrawnIsSaid) {
  test::make_campaign(db, {.raw_data = false, .open_space = false, .columns = 1, .rows = 1, .repeats = 1});
  const WrittenFigures written = write(settings());
  EXPECT_EQ(stems(written.files),
            (std::set<std::string>{"c_t_by_location", "uneven_by_location", "captions"}));
  std::set<std::string> absent;
  for (const AbsentFigure& figure : written.absent) {
    EXPECT_FALSE(figure.reason.empty());
    absent.insert(figure.figure);
  }
  EXPECT_EQ(absent, (std::set<std::string>{"delta_ct", "uneven_thrust", "open_space", "calibration_residuals",
                                           "residual_before_after", "flights"}));
}

TEST_F(DrawnFiguresTest, TheAreaOfTheCoefficientIsSaid) {
  test::make_campaign(db, {.raw_data = false, .open_space = false, .columns = 1, .rows = 1, .repeats = 1});
  write(settings());
  EXPECT_THAT(read_text(out / "captions.md"), HasSubstr("over ½ρΩ²R² and one propeller disc, against"));
  {
    CampaignFile file(db, CampaignFile::Access::kWrite);
    std::string toml = file.info().toml;
    toml.insert(toml.find('\n', toml.find("[rig]")) + 1, "rotor_area_m2 = 0.1459\n");
    file.set_text("campaign.toml", toml);
  }
  write(settings());
  EXPECT_THAT(read_text(out / "captions.md"), HasSubstr("over ½ρΩ²R² and an area of 0.1459 m², against"));
}

TEST_F(DrawnFiguresTest, PathsHaveRoomForTheLabelsOfAWideSection) {
  test::make_campaign(db, {.raw_data = false, .columns = 1, .rows = 1});
  nlohmann::json flights = nlohmann::json::parse(kHostileFlights);
  flights["flights"][0]["walls"] = {{-2.25, 0}, {2.25, 0}, {2.25, 5}, {-2.25, 5}};
  write_text(folder / "flights.json", flights.dump());
  ReportSettings report = settings();
  report.flights = (folder / "flights.json").string();
  write(report, {.format = FigureFormat::kSvg});
  const std::string drawn = read_text(out / "flight_1_paths.svg");
  EXPECT_THAT(drawn, HasSubstr(">−2<"));
  EXPECT_THAT(drawn, testing::Not(HasSubstr(">−1.5<")));
}

TEST_F(DrawnFiguresTest, OpenSpaceAloneAndFewerRotorsAreDrawnToo) {
  for (const test::CampaignParts& parts :
       {test::CampaignParts{.tunnel = false}, test::CampaignParts{.raw_data = false, .rotors = 1}}) {
    std::filesystem::remove(db);
    std::filesystem::remove_all(folder / "c.db.folder");
    test::make_campaign(db, parts);
    EXPECT_THAT(stems(write(settings()).files), testing::IsSupersetOf({"c_t_by_location", "open_space"}));
    EXPECT_EQ(read_text(out / "captions.md").find("the height in the tunnel") != std::string::npos,
              parts.tunnel)
        << "without a tunnel the axis is the distance";
  }
}

TEST_F(FiguresTest, ABadRequestLeavesNothing) {
  test::make_campaign(db, {.raw_data = false});
  for (const double width_mm : {59.9, 401.0, std::nan("")})
    EXPECT_THAT(message_of([&] { write(settings(), {.width_mm = width_mm}); }),
                HasSubstr("from 60 to 400 mm"));
  EXPECT_THAT(message_of([&] { write(settings(), {.gnuplot = "/nonexistent/gnuplot"}); }),
              HasSubstr("/nonexistent/gnuplot is not installed"));
  EXPECT_FALSE(std::filesystem::exists(out));
  EXPECT_THAT(message_of([] { figure_format("eps"); }), HasSubstr("there are pdf, svg and png"));
  std::filesystem::remove(db);
  test::make_table(db);
  EXPECT_THAT(message_of([&] { write(settings()); }), HasSubstr("reduce --plot"));
}

TEST_F(FiguresTest, CurvesAreTheReductions) {
  test::make_campaign(db, {});
  const CampaignFile file(db, CampaignFile::Access::kRead);
  const ReportSettings report = settings();
  const report::Material material = report::gather(file, report);
  const std::string script = report::location_figures(material, 84).drawn[0].script;
  std::multiset<std::pair<double, double>> drawn, expected;
  const auto rounded = [](double value) { return std::stod(fmt::format("{:.7g}", value)); };
  for (const char* name : {"column0", "column1", "column2"}) {
    for (const auto& row : block(script, name)) drawn.insert({row[1], row[2]});
  }
  for (const LocationSummary& location : material.summary->locations) {
    if (location.y_norm) expected.insert({rounded(location.c_t.mean), rounded(location.c_t.u95)});
  }
  EXPECT_EQ(drawn, expected);
}

TEST_F(FiguresTest, ResidualsAreTheCertificates) {
  test::make_campaign(db, {});
  const CampaignFile file(db, CampaignFile::Access::kRead);
  const ReportSettings report = settings();
  const report::Material material = report::gather(file, report);
  const std::string script = report::calibration_figures(material, 84).drawn[0].script;
  const CellFit& cell = material.data.certificate->cells[0];
  const auto band = block(script, "band");
  ASSERT_EQ(band.size(), 2u);
  EXPECT_NEAR(band[0][2], 2000 * cell.residual_std_N(), 1e-4);
  const auto points = block(script, "used");
  ASSERT_EQ(static_cast<int>(points.size()),
            std::count_if(cell.points.begin(), cell.points.end(),
                          [](const auto& p) { return p.weight > 0 && !p.suspicious; }));
  EXPECT_NEAR(points[0][1], 1000 * cell.points[0].residual_N, 1e-4);
}

TEST_F(FiguresTest, AModelsErrorsAreItsExplanations) {
  test::make_campaign(db, {.raw_data = false});
  const CampaignFile file(db, CampaignFile::Access::kRead);
  ReportSettings report = settings();
  report.model.version = test::adopted_model();
  const report::Material material = report::gather(file, report);
  const std::string script = report::residual_figures(material, 84).drawn[0].script;
  EXPECT_EQ(block(script, "before")[0], (std::vector<double>{0.062, 2, 0.05, 0.08}));
  EXPECT_EQ(block(script, "after")[0], (std::vector<double>{0.022, 1, 0.018, 0.026}));
  EXPECT_EQ(block(script, "runs").size(), material.reduction->runs.size());
}

}  // namespace
}  // namespace tunnelrig
