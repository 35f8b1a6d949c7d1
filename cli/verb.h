// A verb is one file: it declares its options on a CLI11 command and sets the function that does its work.
#pragma once

#include "datasets/error.h"

#include <functional>
#include <initializer_list>
#include <string>
#include <string_view>

#include <CLI/CLI.hpp>

namespace tunnelrig::cli {

/// Declares a verb below `app`; its work goes into `run`, which returns the exit code.
using Work = std::function<int()>;

void add_log(CLI::App& app, Work& run);
void add_plan(CLI::App& app, Work& run);
void add_import(CLI::App& app, Work& run);
void add_export(CLI::App& app, Work& run);
void add_calibrate(CLI::App& app, Work& run);
void add_reduce(CLI::App& app, Work& run);
void add_map(CLI::App& app, Work& run);
void add_report(CLI::App& app, Work& run);
void add_explain(CLI::App& app, Work& run);
void add_fly(CLI::App& app, Work& run);
void add_models(CLI::App& app, Work& run);
void add_serve(CLI::App& app, Work& run);
void add_doctor(CLI::App& app, Work& run);
void add_devices(CLI::App& app, Work& run);
void add_demo(CLI::App& app, Work& run);

/// --model and --with, as every verb that reduces has them.
void add_model_options(CLI::App& verb, std::string& model, std::string& terms);

/// What `read` makes of an option's text. Where it throws InputError the option is named before what it says.
template <typename Read>
auto naming(const char* option, const Read& read) {
  try {
    return read();
  } catch (const InputError& error) {
    throw InputError(std::string(option) + ": " + error.what());
  }
}

/// Throws InputError ("OPTION: WHY") where one of the options was given: what is asked for and would not be
/// done is refused, not left out in silence.
void refuse_given(const CLI::App& verb, std::initializer_list<const char*> options, std::string_view why);

}  // namespace tunnelrig::cli
