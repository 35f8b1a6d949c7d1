#include "cli/program.h"

#include "datasets/csv.h"
#include "support/temporary_folder.h"

#include <cstdlib>

#include <sys/wait.h>

namespace tunnelrig::test {

ProgramResult run_program(const std::filesystem::path& folder, const std::string& arguments,
                          const std::string& before) {
  const TemporaryFolder scratch;
  const std::string command = "cd '" + folder.string() + "' && " + before + " && '" TUNNELRIG_PROGRAM "' " +
                              arguments + " >'" + (scratch / "out").string() + "' 2>'" +
                              (scratch / "error").string() + "' </dev/null";
  const int status = std::system(command.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, read_text(scratch / "out"),
          read_text(scratch / "error")};
}

}  // namespace tunnelrig::test
