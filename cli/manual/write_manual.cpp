// write_manual FOLDER DOCUMENTS DATE: manual pages (FOLDER/man1) and the completion of bash
// (FOLDER/completion/tunnelrig). DOCUMENTS is where the documents will be, DATE that of the program, for the
// pages.

#include "cli/console.h"
#include "cli/manual/completion.h"
#include "cli/manual/man_page.h"
#include "cli/verbs.h"
#include "datasets/csv.h"

#include <cstdio>
#include <exception>
#include <filesystem>

#include <fmt/format.h>

namespace tunnelrig::cli {
namespace {

void write_manual(const std::filesystem::path& folder, const ManualPlaces& places) {
  CLI::App program;
  Work work;
  declare_program(program, work);
  std::filesystem::create_directories(folder / "man1");
  std::filesystem::create_directories(folder / "completion");
  write_text(folder / "man1/tunnelrig.1", man_page(program, places));
  for (const CLI::App* verb : verbs_of(program))
    write_text(folder / fmt::format("man1/tunnelrig-{}.1", verb->get_name()),
               man_page_of_verb(program, *verb, places));
  write_text(folder / "completion/tunnelrig", bash_completion(program));
}

}  // namespace
}  // namespace tunnelrig::cli

int main(int argc, char** argv) {
  using namespace tunnelrig::cli;
  if (argc != 4) {
    fmt::print(stderr, "usage: write_manual FOLDER DOCUMENTS DATE\n");
    return kBadInput;
  }
  try {
    write_manual(argv[1], {program_version(), argv[3], argv[2]});
  } catch (const std::exception& error) {
    fmt::print(stderr, "write_manual: {}\n", error.what());
    return kProblemFound;
  }
  return kWell;
}
