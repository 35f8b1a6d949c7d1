// tunnelrig: the program's verbs.

#include "cli/console.h"
#include "cli/verb.h"
#include "datasets/error.h"

#include <cstdio>
#include <exception>

#include <fmt/format.h>

namespace tunnelrig::cli {
namespace {

int report(const std::string& text, int code) {
  const bool colour = error_is_terminal();
  fmt::print(stderr, "{}tunnelrig:{} {}\n", colour ? "\x1b[31m" : "", colour ? "\x1b[0m" : "", text);
  return code;
}

int run(int argc, char** argv) {
  CLI::App app(
      "tunnelrig: from the packets of a static-thrust rig to maps of the disturbance a quadcopter meets in a "
      "tunnel.\n"
      "\n"
      "Exit codes: 0 all is well, 1 a problem was found, 2 bad input.");
  app.set_version_flag("--version", program_version());
  app.require_subcommand(1);
  app.get_formatter()->column_width(34);
  Work work;
  for (const auto add : {add_log, add_plan, add_import, add_export, add_calibrate, add_reduce, add_map,
                         add_report, add_serve, add_devices, add_doctor, add_explain, add_models, add_fly}) {
    add(app, work);
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    const bool asked_for_help = error.get_exit_code() == 0;
    app.exit(error);
    return asked_for_help ? kWell : kBadInput;
  }
  return work();
}

}  // namespace
}  // namespace tunnelrig::cli

int main(int argc, char** argv) {
  using namespace tunnelrig;
  cli::remember_arguments(argc, argv);
  try {
    return cli::run(argc, argv);
  } catch (const InputError& error) {
    return cli::report(error.what(), cli::kBadInput);
  } catch (const StorageError& error) {
    return cli::report(error.what(), cli::kProblemFound);
  } catch (const std::exception& error) {
    return cli::report(fmt::format("this should not have happened: {}", error.what()), cli::kProblemFound);
  }
}
