// All verbs on one command line.
#pragma once

#include "cli/verb.h"

#include <string>

namespace tunnelrig::cli {

/// What the program says of itself, and its exit codes.
extern const char* const kProgramDescription;
extern const char* const kExitCodes;

/// Declares the program with every verb; what was asked for is in `work` after app.parse().
void declare_program(CLI::App& app, Work& work);

}  // namespace tunnelrig::cli
