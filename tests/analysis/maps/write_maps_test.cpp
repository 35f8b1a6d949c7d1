#include "analysis/maps/write_maps.h"

#include "datasets/csv.h"
#include "published_input.h"
#include "support/little_room.h"
#include "support/temporary_folder.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

using test::message_of;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

TunnelMaps example(MapMethod method = MapMethod::kGaussianProcess) {
  return fit_maps(test::published_input(1), {.method = method});
}

std::size_t files_in(const std::filesystem::path& folder) {
  return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(folder), {}));
}

WriteSettings without_pictures() { return {.gnuplot = "/nonexistent/gnuplot"}; }

TEST(WriteMaps, TablesAreAsDocumented) {
  for (const MapMethod method : test::kMethods) {
    const test::TemporaryFolder folder;
    write_maps(folder.path(), example(method), without_pictures());
    for (const char* name : {"delta_ct.csv", "uneven_thrust.csv"}) {
      const std::string text = read_text(folder / name);
      EXPECT_THAT(text, StartsWith("y_norm,z_norm,value_percent,u95_percent\n-1,-1,"));
      EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 1 + 41 * 41);
      EXPECT_THAT(text, HasSubstr("\n0,0,0,0\n"));
      EXPECT_THAT(text, Not(HasSubstr("-0,")));
      EXPECT_THAT(text, Not(HasSubstr("nan")));
    }
    const Sheet uneven = read_csv(folder / "uneven_thrust.csv");
    for (std::size_t i = 0; i < uneven.rows.size(); ++i) {
      if (uneven.text(i, "y_norm") == "0") {
        EXPECT_EQ(uneven.text(i, "value_percent"), "0");
      }
    }
  }
}

/// Single runs without raw data: nothing says how far they scatter, which is no scatter of 0.
TEST(WriteMaps, AnUncertaintyThatIsNotKnownIsEmpty) {
  const test::TemporaryFolder folder;
  MapInput input = test::exact_input();
  input.c_t_covariance.setZero();
  input.u_covariance.setZero();
  input.scatter_known = false;
  write_text(folder / "delta_ct_u95.png", "of another map");
  const TunnelMaps maps = fit_maps(input, {.method = MapMethod::kThinPlateSpline});
  const WrittenMaps written = write_maps(folder.path(), maps, {.nodes = 3});
  EXPECT_THAT(read_text(folder / "delta_ct.csv"), HasSubstr("\n0,0,0,\n"));
  EXPECT_FALSE(read_disturbance_map(folder / "disturbance_map.json").uneven_thrust.u95_known());
  for (const MeasuredLocation& location : written.map.locations) {
    EXPECT_TRUE(std::isnan(location.delta_ct_u95_percent));
    EXPECT_TRUE(std::isnan(location.uneven_thrust_u95_percent));
  }
  EXPECT_FALSE(std::filesystem::exists(folder / "delta_ct_u95.png"));
  EXPECT_EQ(std::filesystem::exists(folder / "delta_ct.png"), !written.warning);
}

TEST(WriteMaps, SaysHowFarItIs) {
  const test::TemporaryFolder folder;
  WriteSettings settings = without_pictures();
  settings.nodes = 3;
  std::vector<int> rows;
  settings.progress = [&](int done, int total) {
    rows.push_back(done);
    EXPECT_EQ(total, 6);
  };
  write_maps(folder.path(), example(), settings);
  EXPECT_THAT(rows, testing::ElementsAre(1, 2, 3, 4, 5, 6));
}

TEST(WriteMaps, TheGridIsTheCallers) {
  const test::TemporaryFolder folder;
  WriteSettings settings = without_pictures();
  settings.nodes = 3;
  write_maps(folder.path(), example(), settings);
  EXPECT_EQ(read_csv(folder / "delta_ct.csv").rows.size(), 9u);
  for (const int nodes : {40, 1, -3, 503, 100001}) {
    settings.nodes = nodes;
    EXPECT_THAT(message_of([&] { write_maps(folder.path(), example(), settings); }),
                HasSubstr("must be odd"));
  }
}

TEST(WriteMaps, ContourLinesLieOnTheirLevel) {
  const test::TemporaryFolder folder;
  const TunnelMaps maps = example();
  write_maps(folder.path(), maps, without_pictures());
  const auto check = [&](const char* name, const FittedField& field, double tolerance_percent) {
    const Sheet lines = read_csv(folder / name);
    EXPECT_THAT(lines.columns, testing::ElementsAre("level_percent", "line", "y_norm", "z_norm"));
    ASSERT_GT(lines.rows.size(), 500u);
    for (std::size_t i = 0; i < lines.rows.size(); ++i) {
      const TunnelPoint point{lines.require_number(i, "y_norm"), lines.require_number(i, "z_norm")};
      EXPECT_NEAR(estimate_at(field, point).value, lines.require_number(i, "level_percent"),
                  tolerance_percent);
    }
  };
  check("delta_ct_contours.csv", maps.delta_ct, 0.01);
  check("uneven_thrust_contours.csv", maps.uneven_thrust, 0.01);
}

TEST(WriteMaps, TheMapCanBeReadBack) {
  const test::TemporaryFolder folder;
  const WrittenMaps written = write_maps(folder.path(), example(), without_pictures());
  const DisturbanceMap map = read_disturbance_map(folder / "disturbance_map.json");
  EXPECT_EQ(map.delta_ct.value_percent, written.map.delta_ct.value_percent);
  EXPECT_EQ(map.grid.nodes(), 41u * 41u);
}

TEST(WriteMaps, WithoutGnuplotThereIsAWarningAndEverythingElse) {
  const test::TemporaryFolder folder;
  write_text(folder / "delta_ct.png", "of another map");
  write_text(folder / "notes.txt", "the user's");
  const WrittenMaps written = write_maps(folder.path(), example(), without_pictures());
  ASSERT_TRUE(written.warning);
  EXPECT_THAT(*written.warning, HasSubstr("/nonexistent/gnuplot is not installed"));
  EXPECT_EQ(written.files.size(), 5u);
  EXPECT_EQ(files_in(folder.path()), 6u);  // and the notes
  EXPECT_TRUE(std::filesystem::exists(folder / "notes.txt"));
}

/// By then the new map is in its place: to fail would deny it.
TEST(WriteMaps, AnOldPictureThatCannotBeRemovedIsAWarning) {
  const test::TemporaryFolder folder;
  std::filesystem::create_directory(folder / "delta_ct.svg");
  write_text(folder / "delta_ct.svg" / "notes.txt", "a folder where a picture was");
  const WrittenMaps written = write_maps(folder.path(), example(), without_pictures());
  EXPECT_EQ(written.files.size(), 5u);
  ASSERT_TRUE(written.warning);
  EXPECT_THAT(*written.warning, HasSubstr("/nonexistent/gnuplot is not installed"));
  EXPECT_THAT(*written.warning, HasSubstr("delta_ct.svg is of another map and cannot be removed"));
}

TEST(WriteMaps, AProgramThatFailsIsNamedWithItsReason) {
  const test::TemporaryFolder folder;
  WriteSettings settings;
  settings.gnuplot = "false";
  EXPECT_EQ(write_maps(folder.path(), example(), settings).warning, "false failed: it gives no reason");
}

TEST(WriteMaps, WritesAllOrNothing) {
  const test::TemporaryFolder folder;
  std::filesystem::create_directory(folder / "uneven_thrust_contours.csv");
  EXPECT_THAT(message_of([&] { write_maps(folder.path(), example(), without_pictures()); }),
              HasSubstr("uneven_thrust_contours.csv: is a folder"));
  EXPECT_EQ(files_in(folder.path()), 1u);
  write_text(folder / "file", "");
  EXPECT_THAT(message_of([&] { write_maps(folder / "file", example(), without_pictures()); }),
              HasSubstr("file: maps cannot be written here"));
}

TEST(WriteMaps, WhatFailsNamesTheTargetAndLeavesNoFolder) {
  const test::TemporaryFolder folder;
  const auto failure_in = [](const std::filesystem::path& target) {
    const test::LittleRoom room(1000);
    return message_of([&] { write_maps(target, example(), without_pictures()); });
  };
  EXPECT_EQ(failure_in(folder / "a/b"),
            (folder / "a/b/disturbance_map.json").string() + ": cannot be written: File too large");
  EXPECT_FALSE(std::filesystem::exists(folder / "a"));
  std::filesystem::create_directory(folder / "mine");
  EXPECT_THAT(failure_in(folder / "mine/new"), HasSubstr("mine/new/disturbance_map.json: cannot be"));
  EXPECT_TRUE(std::filesystem::is_empty(folder / "mine"));
}

/// gnuplot does not look whether its writes succeed; it must not inherit that the signal is ignored.
TEST(WriteMaps, APlotterAtTheLimitOfFileSizesIsEnded) {
  const test::TemporaryFolder folder;
  write_text(folder / "plotter", "#!/bin/sh\nkill -s XFSZ $$\n");
  std::filesystem::permissions(folder / "plotter", std::filesystem::perms::owner_all);
  WriteSettings settings;
  settings.gnuplot = folder / "plotter";
  const test::LittleRoom ample(1 << 30);
  EXPECT_THAT(write_maps(folder / "maps", example(), settings).warning.value_or(""),
              HasSubstr("plotter was ended: File size limit exceeded"));
}

TEST(WriteMaps, DrawsEveryPicture) {
  if (std::system("gnuplot --version > /dev/null 2>&1") != 0) GTEST_SKIP() << "gnuplot is not installed";
  const test::TemporaryFolder folder;
  const WrittenMaps written = write_maps(folder / "a new folder 'with quotes'", example());
  EXPECT_FALSE(written.warning) << written.warning.value_or("");
  EXPECT_EQ(written.files.size(), 13u);
  EXPECT_EQ(files_in(folder / "a new folder 'with quotes'"), 13u);
  for (const char* name : {"delta_ct", "delta_ct_u95", "uneven_thrust", "uneven_thrust_u95"}) {
    const std::filesystem::path stem = folder / "a new folder 'with quotes'" / name;
    const std::string png = read_text(stem.string() + ".png");
    EXPECT_THAT(png, StartsWith("\x89PNG\r\n\x1a\n"));
    // width and height, big-endian, in the header chunk; the file ends with the end chunk
    EXPECT_EQ(png.substr(12, 4), "IHDR");
    EXPECT_EQ(png.substr(16, 8), std::string("\0\0\x04\x4c\0\0\x03\xc0", 8));  // 1100 × 960
    EXPECT_EQ(png.substr(png.size() - 8, 4), "IEND");
    const std::string svg = read_text(stem.string() + ".svg");
    EXPECT_THAT(svg, HasSubstr("<svg"));
    EXPECT_THAT(svg, HasSubstr("</svg>"));
    EXPECT_THAT(svg, HasSubstr("ȳ"));
  }
}

TEST(WriteMaps, DrawsAFieldWithoutAnyContour) {
  if (std::system("gnuplot --version > /dev/null 2>&1") != 0) GTEST_SKIP() << "gnuplot is not installed";
  MapInput flat = test::exact_input({.independent_percent = 0});
  for (LocationEstimate& location : flat.locations) {
    location.c_t = 0.1;
    location.u_percent = 0;
  }
  for (const MapMethod method : test::kMethods) {
    const test::TemporaryFolder folder;
    const WrittenMaps written = write_maps(folder.path(), fit_maps(flat, {.method = method}));
    EXPECT_FALSE(written.warning) << written.warning.value_or("");
    EXPECT_EQ(read_text(folder / "delta_ct_contours.csv"), "level_percent,line,y_norm,z_norm\n");
    EXPECT_EQ(read_disturbance_map(folder / "disturbance_map.json").delta_ct.value_percent[7], 0);
  }
}

}  // namespace
}  // namespace tunnelrig
