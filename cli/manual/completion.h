// Completion of command lines in bash, from the options that the program declares itself.
#pragma once

#include <string>

#include <CLI/CLI.hpp>

namespace tunnelrig::cli {

/// A script for /usr/share/bash-completion/completions: verbs, their options, the values of options that have
/// a choice, files for options and arguments that take a text (campaign files for --db), nothing for numbers.
std::string bash_completion(const CLI::App& program);

}  // namespace tunnelrig::cli
