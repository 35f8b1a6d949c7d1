// A verb is one file: it declares its options on a CLI11 command and sets the function that does its work.
#pragma once

#include <functional>
#include <string>

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

}  // namespace tunnelrig::cli
