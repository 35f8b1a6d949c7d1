// The verb on a machine as it is, board or no board.
#include "cli/program.h"
#include "support/temporary_folder.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace tunnelrig {
namespace {

TEST(Devices, JsonListsWhatIsThere) {
  const test::TemporaryFolder folder;
  const test::ProgramResult result = test::run_program(folder.path(), "devices --json");
  const auto json = nlohmann::json::parse(result.out);
  EXPECT_EQ(json.at("format"), "tunnelrig-devices/1");
  bool problem = false;
  for (const auto& board : json.at("boards")) problem |= board.contains("problem");
  EXPECT_EQ(result.code, problem ? 1 : 0) << result.error;
}

TEST(Devices, ABoardThatIsNotThereIsBadInput) {
  const test::TemporaryFolder folder;
  const test::ProgramResult log =
      test::run_program(folder.path(), "log --db c.db --location OT --session S1 --source usb:NOSUCHBOARD");
  EXPECT_EQ(log.code, 2);
  EXPECT_NE(log.error.find("usb:NOSUCHBOARD: "), std::string::npos) << log.error;
  const test::ProgramResult loader =
      test::run_program(folder.path(), "devices --loader --serial NOSUCHBOARD");
  EXPECT_EQ(loader.code, 2);
}

}  // namespace
}  // namespace tunnelrig
