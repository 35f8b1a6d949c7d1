// A call of the program that must be refused.
#pragma once

#include "cli/program.h"
#include "support/example_campaign.h"
#include "support/temporary_folder.h"

#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tunnelrig::test {

struct Refusals : testing::Test {
  TemporaryFolder folder;
  ExampleCampaign campaign;

  /// What the program says; nothing but `files` may be there afterwards.
  std::string refusal_of(const std::string& arguments, const std::vector<std::string>& files) const {
    const ProgramResult result = run_program(folder.path(), arguments);
    EXPECT_EQ(result.code, 2) << arguments << "\n" << result.error;
    EXPECT_EQ(result.out, "") << arguments;
    std::vector<std::string> left;
    for (const auto& entry : std::filesystem::directory_iterator(folder.path()))
      left.push_back(entry.path().filename().string());
    EXPECT_THAT(left, testing::UnorderedElementsAreArray(files)) << arguments;
    return result.error;
  }
};

}  // namespace tunnelrig::test
