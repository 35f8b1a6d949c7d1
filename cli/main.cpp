// tunnelrig: the program's verbs.

#include "cli/console.h"
#include "cli/verbs.h"
#include "datasets/error.h"

#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <string>
#include <system_error>
#include <vector>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

namespace tunnelrig::cli {
namespace {

int report(const std::string& text, int code) {
  const bool colour = error_is_coloured();
  tell(fmt::format("{}tunnelrig:{} {}\n", colour ? "\x1b[31m" : "", colour ? "\x1b[0m" : "", text));
  return code;
}

int cannot_print() {
  const std::string reason = errno != 0 ? ": " + std::generic_category().message(errno) : "";
  return report("standard output cannot be written" + reason, kBadInput);
}

/// Also where a recording has flushed in between, and gone on: what it has is worth more than what it says.
bool could_print() {
  errno = 0;  // of what failed before, the reason is not kept
  return std::fflush(stdout) == 0 && std::ferror(stdout) == 0 && std::cout.flush().good();
}

/// What CLI11 reads and no range keeps out: what would be a number and is none, and what is below 0 where it
/// would be taken for a very large number.
void refuse_misread_numbers(const CLI::App& app) {
  for (const CLI::Option* option : app.get_options()) {
    const std::string type = option->get_type_name();
    for (const std::string& text : option->results()) {
      if (type.starts_with("FLOAT") && std::isnan(std::strtod(text.c_str(), nullptr)))
        throw InputError(fmt::format("{} {}: a number is required", option->get_name(), text));
      if (type.starts_with("UINT") && text.starts_with('-'))
        throw InputError(fmt::format("{} {}: must not be below 0", option->get_name(), text));
    }
  }
  for (const CLI::App* verb : app.get_subcommands()) refuse_misread_numbers(*verb);
}

int run(int argc, char** argv) {
  CLI::App app;
  Work work;
  declare_program(app, work);
  try {
    app.parse(argc, argv);
  } catch (const CLI::RequiredError& error) {
    // CLI11 says that a verb is missing, and not which word is none.
    const std::vector<std::string> words = app.remaining();
    if (app.get_subcommands().empty() && !words.empty())
      throw InputError(fmt::format("{}: there is no such verb; tunnelrig --help lists them", words.front()));
    app.exit(error);
    return kBadInput;
  } catch (const CLI::ParseError& error) {
    const bool asked_for_help = error.get_exit_code() == 0;
    app.exit(error);
    if (!asked_for_help) return kBadInput;
    return could_print() ? kWell : cannot_print();
  }
  refuse_misread_numbers(app);
  const int code = work();
  return could_print() ? code : cannot_print();
}

/// A stream that was closed (`>&-`) leaves its number to the next file that is opened, and what is printed
/// would go into that. In its place stands what cannot be written.
void hold_closed_streams() {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    if (::fcntl(stream, F_GETFD) == -1) ::open("/dev/null", O_RDONLY);
}

}  // namespace
}  // namespace tunnelrig::cli

int main(int argc, char** argv) {
  using namespace tunnelrig;
  cli::hold_closed_streams();
  std::signal(SIGXFSZ, SIG_IGN);  // a file at its limit (ulimit -f) is a write that fails, like a full disk's
  cli::remember_arguments(argc, argv);
  try {
    return cli::run(argc, argv);
  } catch (const InputError& error) {
    return cli::report(error.what(), cli::kBadInput);
  } catch (const StorageError& error) {
    // For want of room nothing was found: what was asked for could not be done, as where other files cannot
    // be written.
    return cli::report(error.what(), error.disk_full() ? cli::kBadInput : cli::kProblemFound);
  } catch (const std::exception& error) {
    if (std::ferror(stdout) != 0) return cli::cannot_print();
    return cli::report(fmt::format("this should not have happened: {}", error.what()), cli::kProblemFound);
  }
}
