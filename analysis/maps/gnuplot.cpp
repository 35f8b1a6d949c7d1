#include "analysis/maps/gnuplot.h"

#include "datasets/csv.h"

#include <cerrno>
#include <sstream>
#include <system_error>

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

namespace tunnelrig {
namespace {

/// Starts the program in the folder, without a pipe that could block or break. The script is a file by name:
/// from standard input gnuplot reads it byte by byte, which takes seconds for a map.
int spawn(const std::string& program, const std::filesystem::path& folder, pid_t* child) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addchdir_np(&actions, folder.c_str());
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "complaint", O_WRONLY | O_CREAT | O_TRUNC, 0600);
  std::string name = program, no_user_settings = "-d", script = "script";
  char* arguments[] = {name.data(), no_user_settings.data(), script.data(), nullptr};
  const int error = posix_spawnp(child, program.c_str(), &actions, nullptr, arguments, environ);
  posix_spawn_file_actions_destroy(&actions);
  return error;
}

/// gnuplot shows the offending command first and says in its last line what is wrong with it.
std::string last_line(const std::string& text) {
  std::istringstream lines(text);
  std::string last = "it gives no reason";
  for (std::string line; std::getline(lines, line);) {
    if (line.find_first_not_of(" \t") != std::string::npos) last = line;
  }
  return last;
}

}  // namespace

std::string gnuplot_text(std::string_view text) {
  std::string out = "'";
  for (const char c : text) {
    if (static_cast<unsigned char>(c) < ' ')
      out += ' ';
    else
      out += c == '\'' ? std::string("''") : std::string(1, c);
  }
  return out + "'";
}

std::optional<std::string> run_gnuplot(const std::string& program, const std::filesystem::path& folder,
                                       const std::string& script) {
  write_text(folder / "script", script);
  pid_t child = 0;
  const int error = spawn(program, folder, &child);
  if (error == ENOENT) return fmt::format("{} is not installed (Debian: apt install gnuplot-nox)", program);
  if (error != 0)
    return fmt::format("{} cannot be started: {}", program, std::generic_category().message(error));
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return {};
  return fmt::format("{} failed: {}", program, last_line(read_text(folder / "complaint")));
}

}  // namespace tunnelrig
