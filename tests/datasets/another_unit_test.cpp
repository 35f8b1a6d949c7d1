#include "datasets/another_unit.h"

#include "datasets/unit_list.h"
#include "support/seeds.h"

#include <cmath>
#include <random>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tunnelrig {
namespace {

using testing::ElementsAre;

using Parts = std::vector<std::vector<double>>;

/// Parts S1, S2, … of one column.
std::optional<AnotherUnit> found(const Parts& parts, const char* unit, double least = kLeastFactor) {
  std::vector<PartValue> values;
  for (std::size_t p = 0; p < parts.size(); ++p)
    for (const double value : parts[p]) values.push_back({fmt::format("S{}", p + 1), values.size(), value});
  return another_unit(values, unit_from_name(unit), least);
}

std::string unit_of(const Parts& parts, const char* unit) {
  const auto doubt = found(parts, unit);
  return doubt ? std::string(doubt->unit) : "none";
}

/// Five parts about `level` (as it is in `unit`), the third of them written in `other`.
Parts with_third_in(const Unit& unit, const Unit& other, double level, double scatter) {
  std::mt19937_64 random(test::seed());
  std::uniform_real_distribution<double> of(level - scatter, level + scatter);
  Parts parts(5);
  for (auto& part : parts)
    for (int i = 0; i < 8; ++i) part.push_back(of(random));
  for (double& value : parts[2]) value = (unit.convert(value) - other.offset) / other.factor;
  return parts;
}

TEST(AnotherUnit, EveryUnitOfEveryQuantityIsNamed) {
  int tried = 0;
  for (const Unit& unit : known_units())
    for (const Unit& other : known_units()) {
      const double factor = std::abs(std::log(other.factor / unit.factor));
      const bool temperature = unit.quantity == "temperature";
      const bool told = temperature ? other.offset != unit.offset
                                    : factor > std::log(3) && std::abs(factor - std::log(10)) > 1e-3;
      if (other.quantity != unit.quantity || !told) continue;
      const double level = temperature ? (21 - unit.offset) / unit.factor : 7.3;
      const double scatter = temperature ? 1.5 / unit.factor : 0.004 * level;
      const auto doubt = found(with_third_in(unit, other, level, scatter), unit.name.data());
      ASSERT_TRUE(doubt) << other.name << " among " << unit.name;
      EXPECT_THAT(doubt->parts, ElementsAre("S3"));
      EXPECT_NEAR(unit_from_name(doubt->unit).factor / other.factor, 1, 1e-6)
          << other.name << " among " << unit.name;
      EXPECT_EQ(doubt->first_row, 16u);
      EXPECT_EQ(doubt->last_row, 23u);
      EXPECT_NEAR(doubt->converted.lowest, level, 1.001 * scatter);
      ++tried;
    }
  EXPECT_GT(tried, 200);
}

TEST(AnotherUnit, NothingIsSaidWhereAllAreInOne) {
  EXPECT_FALSE(found({{19.5, 20.1}, {21, 24}, {22.5, 23}}, "°C"));
  EXPECT_FALSE(found({{1, 3}, {30, 31}, {12, 14}, {20, 25}}, "°C")) << "another season";
  EXPECT_FALSE(found({{5000, 5000}, {5000, 5000}, {5000, 5000}}, "rpm"));
  EXPECT_FALSE(found({}, "rpm"));
}

TEST(AnotherUnit, TwoPartsAreNoneToCompareWith) {
  EXPECT_FALSE(found({{20, 21}, {68, 70}}, "°C")) << "either may be wrong";
  EXPECT_TRUE(found({{20, 21}, {68, 70}, {19.5, 20}}, "°C"));
  EXPECT_FALSE(found({{20}, {68}, {20}, {69}}, "°C"));
  EXPECT_FALSE(found({{20}, {68}, {20}, {69}, {21}}, "°C")) << "two of five";
}

TEST(AnotherUnit, SeveralPartsOfManyAreDoubtedTogether) {
  const auto doubt = found({{20, 21}, {68, 70}, {19.5, 20}, {71}, {20}, {21.5}}, "°C");
  ASSERT_TRUE(doubt);
  EXPECT_THAT(doubt->parts, ElementsAre("S2", "S4"));
  EXPECT_EQ(doubt->written.highest, 71);
  EXPECT_EQ(doubt->others.highest, 21.5);
}

/// What is set session by session is not doubted, but where it hits another unit.
TEST(AnotherUnit, SettingsAreNoMistakes) {
  EXPECT_FALSE(found({{2000}, {4000}, {6000}, {19}}, "rpm"));
  EXPECT_FALSE(found({{2000}, {4000}, {6000}, {8000}, {100}}, "rpm")) << "6000 in rev/s";
  EXPECT_FALSE(found({{20}, {20}, {2}}, "m"));
  EXPECT_FALSE(found({{100, 100}, {100, 100}, {10, 10}}, "mm")) << "cm, or a setting";
  EXPECT_FALSE(found({{1}, {1}, {0.1}}, "N")) << "0.98 N in kgf";
  EXPECT_FALSE(found({{5, 5.1}, {5.05, 5.1}, {9.72, 9.9}}, "m/s")) << "kt: too small a factor to tell";
  EXPECT_FALSE(found({{20}, {30}, {40}, {50}, {95}}, "°C"));
  EXPECT_FALSE(found({{20, 20.1}, {60, 60.2}, {20, 20.2}}, "°C")) << "15.6 °C in °F";
}

TEST(AnotherUnit, OfTwoUnitsThatFitNoneIsNamed) {
  EXPECT_TRUE(found({{101290, 101300}, {101310, 101330}, {1.0128, 1.0132}}, "Pa"));
  EXPECT_FALSE(found({{99800, 100500}, {101500, 102300}, {1.0005, 1.003}}, "Pa")) << "bar or atm";
}

/// A sweep within each session, as far as 0 and by direction.
TEST(AnotherUnit, SweepsAreComparedByTheirEnds) {
  const Parts sweeps = {{0, 2000, 4000, 8000}, {0, 2050, 4010, 7900}, {0, 33.5, 66, 133}};
  const auto doubt = found(sweeps, "rpm");
  ASSERT_TRUE(doubt);
  EXPECT_EQ(doubt->unit, "rev/s");
  EXPECT_EQ(doubt->written.lowest, 33.5) << "0 is 0 in any unit";
  EXPECT_FALSE(found({sweeps[0], sweeps[1], {0, 60, 90}}, "rpm")) << "3600 to 5400 of 2000 to 8000";
  EXPECT_EQ(unit_of({{10, 15, 20}, {10, 14, 19.9}, {101, 202}}, "cm"), "mm");
  EXPECT_EQ(unit_of({{10, 20, 40}, {10, 21, 39}, {101, 200, 405}}, "cm"), "none") << "40 to 101 is no gap";
  EXPECT_EQ(unit_of({{-7, 7}, {7.1, -7.2}, {-715, 720}}, "N"), "gf");
}

/// Groups may be rotors of other sizes.
TEST(AnotherUnit, GroupsDifferBySmallFactors) {
  const Parts lbf = {{10, 10.1}, {9.9, 10}, {2.25, 2.26}}, gf = {{10, 10.1}, {9.9, 10}, {1020, 1025}};
  EXPECT_EQ(unit_of(lbf, "N"), "lbf");
  EXPECT_FALSE(found(lbf, "N", kLeastFactorOfGroups));
  EXPECT_TRUE(found(gf, "N", kLeastFactorOfGroups));
}

}  // namespace
}  // namespace tunnelrig
