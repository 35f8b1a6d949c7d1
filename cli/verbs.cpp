#include "cli/verbs.h"

#include "cli/console.h"
#include "cli/verb.h"
#include "datasets/error.h"

#include <fmt/format.h>

namespace tunnelrig::cli {

const char* const kProgramDescription =
    "tunnelrig: from the packets of a static-thrust rig to maps of the disturbance a quadcopter meets in a "
    "tunnel.";
const char* const kExitCodes =
    "Exit codes: 0 all is well, 1 a problem was found, 2 bad input, or a disk without room.";

void declare_program(CLI::App& app, Work& work) {
  app.name("tunnelrig");
  app.description(std::string(kProgramDescription) + "\n\n" + kExitCodes);
  app.set_version_flag("--version", program_version());
  app.require_subcommand(1);
  app.get_formatter()->column_width(34);
  for (const auto add :
       {add_demo, add_log, add_plan, add_import, add_export, add_calibrate, add_reduce, add_map, add_report,
        add_serve, add_devices, add_doctor, add_explain, add_models, add_fly}) {
    add(app, work);
  }
}

void refuse_given(const CLI::App& verb, std::initializer_list<const char*> options, std::string_view why) {
  for (const char* option : options)
    if (verb.count(option) > 0) throw InputError(fmt::format("{}: {}", option, why));
}

}  // namespace tunnelrig::cli
