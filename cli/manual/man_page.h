// Manual pages of the program and its verbs, from the options that it declares itself.
#pragma once

#include <string>

#include <CLI/CLI.hpp>

namespace tunnelrig::cli {

/// Where things stand that a page names.
struct ManualPlaces {
  std::string version, date;  // of the program
  std::string documents;      // the folder of README.md and docs/
};

/// tunnelrig(1): what there is, each verb with a line.
std::string man_page(const CLI::App& program, const ManualPlaces& places);

/// tunnelrig-VERB(1): synopsis, what --help says of it, options, examples.
std::string man_page_of_verb(const CLI::App& program, const CLI::App& verb, const ManualPlaces& places);

/// The verbs in the order of --help.
std::vector<const CLI::App*> verbs_of(const CLI::App& program);

}  // namespace tunnelrig::cli
