#pragma once

#include <filesystem>
#include <string>

namespace tunnelrig::test {

struct ProgramResult {
  int code = -1;
  std::string out, error;
};

/// Runs `tunnelrig ARGUMENTS` by the shell, in `folder`, after what the shell is to do before ("ulimit -f
/// 10").
ProgramResult run_program(const std::filesystem::path& folder, const std::string& arguments,
                          const std::string& before = "true");

}  // namespace tunnelrig::test
