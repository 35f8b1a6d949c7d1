#include "analysis/maps/gnuplot.h"

#include "datasets/csv.h"

#include <cerrno>
#include <csignal>
#include <cstring>
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
  // The program ignores what ends a process at a limit of file sizes; gnuplot would not look at its writes.
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t as_usual;
  sigemptyset(&as_usual);
  sigaddset(&as_usual, SIGXFSZ);
  posix_spawnattr_setsigdefault(&attributes, &as_usual);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGDEF);
  std::string name = program, no_user_settings = "-d", script = "script";
  char* arguments[] = {name.data(), no_user_settings.data(), script.data(), nullptr};
  const int error = posix_spawnp(child, program.c_str(), &actions, &attributes, arguments, environ);
  posix_spawnattr_destroy(&attributes);
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
  if (WIFSIGNALED(status)) return fmt::format("{} was ended: {}", program, sigdescr_np(WTERMSIG(status)));
  return fmt::format("{} failed: {}", program, last_line(read_text(folder / "complaint")));
}

}  // namespace tunnelrig
