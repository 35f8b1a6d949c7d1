#include "analysis/model/model_store.h"
#include "analysis/residual/observations/observations.h"
#include "analysis/run_summary.h"
#include "cli/console.h"
#include "cli/verb.h"
#include "datasets/campaign_folder.h"
#include "datasets/error.h"
#include "datasets/observations.h"
#include "datasets/rcbenchmark.h"
#include "datasets/unit_doubts.h"

#include <chrono>
#include <exception>
#include <filesystem>
#include <memory>
#include <optional>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace tunnelrig::cli {
namespace {

struct ImportVerbOptions {
  std::string source, db, format = "folder", schema, sweeps;
  bool replace = false, allow_stuck = false, json = false;
  std::optional<double> propeller_diameter_m;
  std::optional<int> pole_count;
};

int import_folder(const ImportVerbOptions& options) {
  ProgressBar bar("import");
  ImportOptions how{.replace = options.replace,
                    .allow_stuck = options.allow_stuck,
                    .summarizer = [](const CampaignInfo& info,
                                     const RawFormat& format) { return make_run_summarizer(info, format); },
                    .progress = show_on(bar)};
  const auto start = std::chrono::steady_clock::now();
  const ImportSummary summary = import_campaign_folder(options.source, options.db, how);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  for (const std::string& doubt : summary.doubts) warn(doubt);
  if (options.json) {
    fmt::print("{}\n", nlohmann::json{{"db", options.db},
                                      {"runs", summary.runs},
                                      {"raw_runs", summary.raw_runs},
                                      {"frames", summary.frames},
                                      {"raw_bytes", summary.raw_bytes},
                                      {"seconds", seconds},
                                      {"doubts", summary.doubts}}
                           .dump(1));
  } else {
    fmt::print("{}: {} runs, {} with raw data, {} frames, {:.1f} MB at {:.0f} MB/s\n", options.db,
               summary.runs, summary.raw_runs, summary.frames, 1e-6 * static_cast<double>(summary.raw_bytes),
               1e-6 * static_cast<double>(summary.raw_bytes) / seconds);
  }
  return kWell;
}

ObservationTable read_rows(const ImportVerbOptions& options) {
  if (options.format == "rcbenchmark")
    return read_rcbenchmark(options.source, {.propeller_diameter_m = options.propeller_diameter_m,
                                             .pole_count = options.pole_count,
                                             .sweeps_csv = options.sweeps,
                                             .schema = options.schema});
  if (options.schema.empty())
    throw InputError("--format table: --schema S.toml is required; it says what the columns are");
  return read_table(options.source, options.schema);
}

nlohmann::ordered_json column_json(const TableColumn& column) {
  return {{"column", column.column}, {"unit", column.kept_unit()}, {"meaning", column.meaning}};
}

/// "Tair [°C] as air_temperature_C", in the unit that it is kept in.
std::string in_words(const TableColumn& column) {
  const std::string_view unit = column.kept_unit();
  return column.column + (unit == "1" ? "" : fmt::format(" [{}]", unit)) +
         (column.meaning.empty() ? "" : " as " + column.meaning);
}

void print_rows(const ImportVerbOptions& options, const ObservationTable& table, const TableParts& parts,
                const std::vector<std::string>& doubts) {
  if (options.json) {
    nlohmann::ordered_json json{{"db", options.db},
                                {"observations", table.rows.size()},
                                {"groups", parts.groups},
                                {"blocks", parts.blocks},
                                {"response", column_json(table.schema.response)},
                                {"covariates", nlohmann::ordered_json::array()}};
    for (const TableColumn& column : table.schema.covariates)
      json["covariates"].push_back(column_json(column));
    if (options.format == "rcbenchmark") json["rows_without_response"] = table.without_response;
    json["doubts"] = doubts;
    fmt::print("{}\n", json.dump(1));
    return;
  }
  std::string covariates;
  for (const TableColumn& column : table.schema.covariates)
    covariates += (covariates.empty() ? "covariates " : ", ") + in_words(column);
  fmt::print("{}: {} observations in {} {} and {} {}; response {}; {}\n", options.db, table.rows.size(),
             parts.groups, parts.groups == 1 ? "group" : "groups", parts.blocks,
             parts.blocks == 1 ? "block" : "blocks", in_words(table.schema.response),
             covariates.empty() ? "no covariates" : covariates);
  if (table.without_response > 0)
    fmt::print("{} of {} rows have no {}, and are left out\n", table.without_response,
               table.without_response + table.rows.size(), table.schema.response.column);
}

int import_rows(const ImportVerbOptions& options) {
  const ObservationTable table = read_rows(options);
  const TableParts parts = check_table(table);
  store_table(table, options.db, options.replace);
  std::vector<std::string> doubts = unit_doubts(table).sentences;
  if (options.format == "rcbenchmark" && !table.schema.speed_column)
    doubts.push_back(
        "no column Motor Optical Speed or Motor Electrical Speed has a value: thrust without speed gives no "
        "C_T");
  for (const TableColumn& column : table.schema.covariates)
    if (column.column == table.schema.response.column)
      doubts.push_back(fmt::format("{} is the response: it is no covariate of itself", column.column));
  for (const std::string& doubt : doubts) warn(doubt);
  print_rows(options, table, parts, doubts);
  return kWell;
}

/// Of the model, in the campaign that is replaced; 0 where it cannot be read.
std::size_t versions_in(const std::string& db) {
  try {
    return std::filesystem::exists(db) ? stored_models(CampaignFile(db, CampaignFile::Access::kRead)).size()
                                       : 0;
  } catch (const std::exception&) {
    return 0;
  }
}

/// Options that say how another kind of source is to be read.
void refuse_of_other_formats(const ImportVerbOptions& options, const CLI::App& verb) {
  const std::string why = fmt::format("is not for --format {}; ", options.format);
  if (options.format != "folder")
    refuse_given(verb, {"--allow-stuck"}, why + "a campaign folder alone has channels");
  if (options.format != "rcbenchmark")
    refuse_given(verb, {"--sweeps", "--propeller-diameter-m", "--pole-count"},
                 why + "it is of sweeps (--format rcbenchmark)");
  if (options.format == "folder")
    refuse_given(verb, {"--schema"}, why + "the folder's files say what their columns are");
}

int run_import(const ImportVerbOptions& options, const CLI::App& verb) {
  refuse_of_other_formats(options, verb);
  const std::size_t lost = options.replace ? versions_in(options.db) : 0;
  const int code = options.format == "folder" ? import_folder(options) : import_rows(options);
  if (lost > 0)
    warn(
        fmt::format("{} {} of the model that explain --adopt had stored in {} went with the campaign that "
                    "was replaced",
                    lost, lost == 1 ? "version" : "versions", options.db));
  return code;
}

}  // namespace

void add_import(CLI::App& app, Work& work) {
  auto options = std::make_shared<ImportVerbOptions>();
  CLI::App* verb =
      app.add_subcommand("import", "Read a campaign folder, sweeps or a table into a campaign file");
  verb->footer(
      "The file appears whole or not at all. docs/campaign-folder.md and docs/tables.md describe what is "
      "read.\n\n"
      "Examples: tunnelrig import my_campaign --db my.db\n"
      "          tunnelrig import sweeps/ --format rcbenchmark --propeller-diameter-m 0.127 --db sweeps.db\n"
      "          tunnelrig import static.csv --format table --schema static.toml --db static.db");
  verb->add_option("source", options->source, "Campaign folder; CSV file or folder of sweeps; CSV table")
      ->required();
  verb->add_option("--db", options->db, "Campaign file to make")->required();
  verb->add_option("--format", options->format, "What the source is")
      ->check(CLI::IsMember({"folder", "rcbenchmark", "table"}))
      ->capture_default_str();
  verb->add_flag("--replace", options->replace, "Discard the campaign that the file holds");
  verb->add_flag("--allow-stuck", options->allow_stuck, "Take runs with a channel that never changes");
  verb->add_option("--schema", options->schema, "What a table's columns mean (docs/tables.md)");
  verb->add_option("--sweeps", options->sweeps,
                   "CSV of what is known of each sweep: file, group, propeller_diameter_m, …");
  verb->add_option("--propeller-diameter-m", options->propeller_diameter_m, "Of all sweeps");
  verb->add_option("--pole-count", options->pole_count,
                   "Of the motor, where the speed column counts electrical revolutions");
  verb->add_flag("--json", options->json, "Print the summary as JSON");
  verb->callback([options, verb, &work] { work = [options, verb] { return run_import(*options, *verb); }; });
}

}  // namespace tunnelrig::cli
