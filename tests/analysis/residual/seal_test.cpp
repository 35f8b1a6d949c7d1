#include "analysis/residual/explanation/seal.h"

#include "analysis/residual/simulated.h"
#include "support/seeds.h"

#include <set>

#include <gmock/gmock.h>

namespace tunnelrig {
namespace {

std::set<int> blocks_of(const Observations& observations, const std::vector<int>& rows) {
  std::set<int> blocks;
  for (const int row : rows) blocks.insert(observations.block[static_cast<std::size_t>(row)]);
  return blocks;
}

struct SealTest : testing::Test {
  std::mt19937_64 random{test::seed()};
};

TEST_F(SealTest, TakesAQuarterOfWholeBlocksSpreadOverTime) {
  for (const int blocks : {6, 8, 12, 16, 24, 40}) {
    const Observations observations =
        test::simulate({.runs_of_block = std::vector<int>(static_cast<std::size_t>(blocks), 5)}, random);
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
      const Seal seal = seal_blocks(observations, seed);
      EXPECT_EQ(seal.open.size() + seal.sealed.size(), static_cast<std::size_t>(observations.rows()));
      const std::set<int> sealed = blocks_of(observations, seal.sealed);
      std::vector<int> both;
      const std::set<int> open = blocks_of(observations, seal.open);
      std::set_intersection(open.begin(), open.end(), sealed.begin(), sealed.end(), std::back_inserter(both));
      EXPECT_TRUE(both.empty()) << "a block is sealed as a whole";
      const auto wanted = static_cast<int>(sealed.size());
      EXPECT_NEAR(wanted, blocks / 4.0, 0.51);
      int part = 0;
      for (const int block : sealed) {  // one of every four neighbours
        EXPECT_GE(block, part * blocks / wanted);
        EXPECT_LT(block, (part + 1) * blocks / wanted);
        ++part;
      }
    }
  }
}

TEST_F(SealTest, EveryLocationKeepsAnOpenRunWherePossible) {
  Observations observations = test::simulate({.runs_of_block = std::vector<int>(16, 6), .groups = 4}, random);
  // a location in one block of each quarter only
  observations.group_name.emplace_back("H9V9");
  for (const std::size_t block : {1U, 5U, 9U, 14U}) observations.group[6 * block] = 4;
  observations.group_name.emplace_back("H8V8");  // and one that was visited once
  observations.group[6 * 3] = 5;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    const Seal seal = seal_blocks(observations, seed);
    EXPECT_TRUE(seal.only_sealed.empty()) << "seed " << seed;
    EXPECT_FALSE(blocks_of(observations, seal.sealed).contains(3)) << "seed " << seed;
  }
}

TEST_F(SealTest, SaysWhichLocationsItCouldNotKeepOpen) {
  Observations observations = test::simulate({.runs_of_block = std::vector<int>(8, 4), .groups = 8}, random);
  for (std::size_t row = 0; row < observations.group.size(); ++row)
    observations.group[row] = observations.block[row];  // a location a session
  const Seal seal = seal_blocks(observations, 1);
  EXPECT_EQ(seal.only_sealed.size(), blocks_of(observations, seal.sealed).size());
  for (const int block : blocks_of(observations, seal.sealed))
    EXPECT_THAT(seal.only_sealed,
                testing::Contains(observations.group_name[static_cast<std::size_t>(block)]));
}

TEST_F(SealTest, IsReproducibleAndDependsOnTheSeed) {
  const Observations observations = test::simulate({.runs_of_block = std::vector<int>(20, 5)}, random);
  std::set<std::vector<int>> different;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Seal seal = seal_blocks(observations, seed);
    EXPECT_EQ(seal.sealed, seal_blocks(observations, seed).sealed);
    different.insert(seal.sealed);
  }
  EXPECT_GT(different.size(), 10u);
}

TEST_F(SealTest, HoldOutReplacesIt) {
  Observations observations = test::simulate({.runs_of_block = std::vector<int>(10, 4), .groups = 2}, random);
  std::vector<int> wanted;
  for (int row = 0; row < 40; ++row) {
    observations.held_out.push_back(row % 3 == 0);
    if (row % 3 == 0) wanted.push_back(row);
  }
  for (std::uint64_t seed = 1; seed <= 5; ++seed) EXPECT_EQ(seal_blocks(observations, seed).sealed, wanted);
  for (std::size_t row = 0; row < observations.group.size(); ++row)
    observations.held_out[row] = observations.group[row] == 1;
  EXPECT_THAT(seal_blocks(observations, 1).only_sealed, testing::ElementsAre("H1V0"));
}

}  // namespace
}  // namespace tunnelrig
