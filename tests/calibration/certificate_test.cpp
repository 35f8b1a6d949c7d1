#include "calibration/certificate.h"

#include "calibration/points.h"
#include "support/temporary_folder.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

using test::message_of;
using test::SyntheticCell;
using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;
using testing::Not;

std::vector<CalibrationPoint> four_cells(unsigned seed, int count = 10) {
  std::mt19937 engine(seed);
  std::vector<CalibrationPoint> points;
  for (int cell = 1; cell <= 4; ++cell) {
    for (CalibrationPoint point :
         SyntheticCell{.zero_V = 0.3 + 0.01 * cell, .cell = cell}.points(count, engine)) {
      point.line = static_cast<int>(points.size()) + 2;
      points.push_back(point);
    }
  }
  return points;
}

std::vector<PropellerTest> four_propellers() {
  std::vector<PropellerTest> tests;
  tests.reserve(8);
  for (int i = 0; i < 8; ++i) {
    tests.push_back({.propeller = std::string(1, static_cast<char>('A' + i / 2)),
                     .rotor = 1 + i / 2,
                     .direction = i < 4 ? "CCW" : "CW",
                     .thrust_N = 7.4 + 0.03 * i + 0.01 * (i % 2),
                     .line = i + 2});
  }
  return tests;
}

/// A certificate with every optional part filled.
Certificate full_certificate() {
  auto points = four_cells(1, 24);
  for (std::size_t i = 0; i < points.size(); ++i) {  // forces and directions that allow every check
    const std::size_t at = i % 24;
    const double force = 2.0 * static_cast<double>(at % 12 < 6 ? at % 12 : 11 - at % 12);
    points[i].voltage_V += 0.242 * (force - points[i].applied_force_N);
    points[i].applied_force_N = force;
    points[i].direction = at % 12 < 6 ? "up" : "down";
    points[i].air_temperature_C = 20 + 0.1 * static_cast<double>(at);
  }
  points[7].voltage_V += 0.5;
  return calibrate(points, four_propellers(), {.cell = {.loss = RobustLoss::kTukey, .gauge_force_N = 0.01}});
}

TEST(Certificate, ComesBackFromJsonBitByBit) {
  for (const Certificate& certificate : {full_certificate(), calibrate(four_cells(2), {})}) {
    const std::string json = to_json(certificate);
    const Certificate back = certificate_from_json(json);
    EXPECT_EQ(to_json(back), json);
    ASSERT_EQ(back.cells.size(), 4u);
    for (std::size_t i = 0; i < 4; ++i) {
      EXPECT_EQ(back.cells[i].zero_V, certificate.cells[i].zero_V);
      EXPECT_EQ(back.cells[i].gain_V_per_N, certificate.cells[i].gain_V_per_N);
      EXPECT_EQ(back.cells[i].covariance, certificate.cells[i].covariance);
      EXPECT_EQ(back.cells[i].points.size(), certificate.cells[i].points.size());
    }
    EXPECT_EQ(back.propellers.covariance, certificate.propellers.covariance);
    EXPECT_EQ(format_certificate(back), format_certificate(certificate));
  }
}

TEST(Certificate, AnythingElseIsRefused) {
  const auto refusal = [](const std::string& text) {
    return message_of([&] { certificate_from_json(text); });
  };
  EXPECT_THAT(refusal("{"), HasSubstr("no calibration certificate"));
  EXPECT_THAT(refusal("{}"), HasSubstr("no calibration certificate"));
  EXPECT_THAT(refusal(R"({"format": "tunnelrig-calibration/9"})"),
              HasSubstr("format \"tunnelrig-calibration/9\""));
  std::string json = to_json(calibrate(four_cells(2), {}));
  const auto at = json.find("\"covariance\":[[");
  json.replace(at, 15, "\"covariance\":[[1],[");
  EXPECT_THAT(refusal(json), Not(HasSubstr("no InputError")));
}

TEST(Certificate, SoundCellsPassAndBadOnesAreSaidToBe) {
  EXPECT_TRUE(calibrate(four_cells(3), four_propellers()).passed());
  auto points = four_cells(3);
  for (CalibrationPoint& point : points) {  // cell 2: everybody leant on the gauge
    if (point.cell == 2) point.voltage_V += 0.15 * std::sin(40.0 * point.applied_force_N);
  }
  const Certificate certificate = calibrate(points, {});
  EXPECT_FALSE(certificate.passed());
  for (const CalibrationGate& gate : certificate.gates) {
    EXPECT_TRUE(gate.passed || gate.cell == 2) << gate.name;
    EXPECT_TRUE(!gate.passed || gate.cell != 2 || gate.name != "correlation") << gate.finding;
  }
  const std::string text = format_certificate(certificate);
  EXPECT_THAT(text, AllOf(HasSubstr("FAILED"), HasSubstr("cell 2, correlation"), HasSubstr("not tested")));
}

TEST(Certificate, AGrossPointIsInTheWarningsAndInTheTable) {
  auto points = four_cells(4);
  points[23].voltage_V -= 0.3;  // cell 3, file line 25
  const Certificate certificate = calibrate(points, {});
  EXPECT_THAT(certificate.warnings,
              Contains(AllOf(HasSubstr("cell 3"), HasSubstr("line 25"), HasSubstr("left out"))));
  EXPECT_THAT(format_certificate(certificate), HasSubstr("     3     25 "));
  EXPECT_TRUE(certificate.passed());
}

TEST(Certificate, APropellerTestInGramsIsNamed) {
  const auto points = four_cells(4);
  const auto odd = [&](std::vector<PropellerTest> tests) {
    std::string found;
    for (const std::string& warning : calibrate(points, tests).warnings)
      if (warning.starts_with("propeller tests: ")) found += warning;
    return found;
  };
  std::vector<PropellerTest> tests = four_propellers();
  EXPECT_EQ(odd(tests), "");
  tests[2].thrust_N *= 1.9;
  EXPECT_EQ(odd(tests), "") << "no other unit is so near";
  tests = four_propellers();
  tests[5].thrust_N = 769;
  EXPECT_THAT(odd(tests),
              HasSubstr("line 7 (propeller C on rotor 3) has 769 N where the median of the others is "
                        "7.5 N; are these newtons (not grams)?"));
  tests[5].thrust_N = 0.769;  // kilograms
  EXPECT_THAT(odd(tests), HasSubstr("line 7 (propeller C on rotor 3) has 0.769 N"));
  for (PropellerTest& test : tests)
    test.thrust_N = test.rotor > 2 ? 769 : 7.5;  // half of them: none can be told right
  EXPECT_THAT(odd(tests), HasSubstr("and 5 more"));
}

TEST(Certificate, ForceAndItsSensitivitiesAgreeWithDifferences) {
  Certificate certificate = calibrate(four_cells(5), {});
  const double voltage = 2.1, step = 1e-6;
  for (const auto& tare : {std::optional<double>(), std::optional<double>(0.33)}) {
    const ForceReading reading = certificate.force(2, voltage, tare);
    EXPECT_EQ(reading.zero_from_calibration, !tare);
    EXPECT_NEAR((certificate.force(2, voltage + step, tare).force_N - reading.force_N) / step,
                reading.d_voltage_N_per_V, 1e-6);
    Certificate shifted = certificate;
    shifted.cells[1].zero_V += step;
    EXPECT_NEAR((shifted.force(2, voltage, tare).force_N - reading.force_N) / step, reading.d_zero_N_per_V,
                1e-6);
    shifted = certificate;
    shifted.cells[1].gain_V_per_N += step;
    EXPECT_NEAR((shifted.force(2, voltage, tare).force_N - reading.force_N) / step, reading.d_gain_N2_per_V,
                1e-3);
    const double with_tare = tare ? certificate.force(2, voltage, *tare + step).force_N : reading.force_N;
    EXPECT_NEAR((with_tare - reading.force_N) / step, reading.d_tare_N_per_V, 1e-6);
  }
  EXPECT_TRUE(certificate.force(2, 0.4).extrapolated);
  EXPECT_FALSE(certificate.force(2, voltage).extrapolated);
}

TEST(Certificate, HashFollowsThePoints) {
  const auto points = four_cells(6);
  const auto tests = four_propellers();
  const std::string hash = hash_of(points, tests);
  EXPECT_EQ(calibrate(points, tests).points_hash, hash);
  auto other = points;
  other[3].voltage_V = std::nextafter(other[3].voltage_V, 10);
  EXPECT_NE(hash_of(other, tests), hash);
  EXPECT_NE(hash_of(points, {}), hash);
  other = points;
  other[3].line = 99;  // where a point stands is not what it says
  EXPECT_EQ(hash_of(other, tests), hash);
}

TEST(Certificate, SaysWhatIsMissing) {
  auto points = four_cells(7);
  std::erase_if(points, [](const CalibrationPoint& point) { return point.cell == 3; });
  EXPECT_THAT(message_of([&] { calibrate(points, {}); }), HasSubstr("calibration.csv: cell 3 has no points"));
  EXPECT_THAT(message_of([&] { calibrate(points, {}, {.rotors = 3}); }),
              HasSubstr("cell 4 is none of 1 to 3"));
  const Certificate certificate = calibrate(four_cells(7), {});
  EXPECT_THAT(certificate.warnings, Contains(HasSubstr("no propeller tests")));
  EXPECT_THAT(certificate.warnings, Contains(HasSubstr("cell 1, 2, 3, 4: no force near zero was applied")));
}

TEST(Certificate, ACampaignOfSomebodyElseIsCalibrated) {
  SKIP_WITHOUT_SHARED_DATA();
  const auto folder = test::shared_data() / "example_campaign";
  const auto points = parse_calibration(read_csv(folder / "calibration.csv"), 4);
  const Certificate certificate = calibrate(points, parse_propellers(read_csv(folder / "propellers.csv"), 4));
  EXPECT_TRUE(certificate.passed()) << format_certificate(certificate);
  EXPECT_NEAR(certificate.propellers.factor.mean(), 1, 1e-12);
}

}  // namespace
}  // namespace tunnelrig
