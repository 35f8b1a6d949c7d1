#pragma once

#include <filesystem>
#include <string>

namespace tunnelrig::test {

struct ProgramResult {
  int code = -1;
  std::string out, error;
};

/// Runs `tunnelrig ARGUMENTS` by the shell, in `folder`.
ProgramResult run_program(const std::filesystem::path& folder, const std::string& arguments);

}  // namespace tunnelrig::test
