#include "analysis/exports/export_campaign.h"
#include "cli/console.h"
#include "cli/verb.h"
#include "datasets/campaign_folder.h"
#include "datasets/error.h"

#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>

namespace tunnelrig::cli {
namespace {

struct ExportOptions {
  std::string db, target, format = "folder", parts, model, terms;
};

int export_folder(const CampaignFile& file, const ExportOptions& options) {
  if (!options.parts.empty() || !options.model.empty() || !options.terms.empty())
    throw InputError(
        "--parts, --model and --with are for --format hdf5, mat, csv and npy; a campaign folder holds what "
        "was measured, all of it");
  ProgressBar bar("export");
  const std::vector<std::string> unfinished = export_campaign_folder(file, options.target, show_on(bar));
  for (const std::string& run : unfinished)
    warn(fmt::format(
        "run {} is being recorded, or its recorder was killed: the folder has it as far as it got, "
        "excluded as partial",
        run));
  fmt::print(
      "{}: {} runs{}\n", options.target, file.runs().size(),
      unfinished.empty() ? "" : fmt::format(", {} of them not recorded to the end", unfinished.size()));
  return kWell;
}

int run_export(const ExportOptions& options) {
  const CampaignFile file(options.db, CampaignFile::Access::kRead);
  if (options.format == "folder") return export_folder(file, options);
  const exports::Settings settings{.format = exports::format_from_name(options.format),
                                   .parts = exports::parts_from_names(options.parts),
                                   .model = choose_model(file, options.model, options.terms),
                                   .program_version = program_version(),
                                   .arguments = arguments(),
                                   .created_utc = now_utc()};
  ProgressBar bar("export");
  const exports::Exported exported = exports::export_campaign(file, options.target, settings, show_on(bar));
  for (const exports::Absent& absent : exported.absent)
    fmt::print("without {}: {}\n", absent.part, absent.reason);
  fmt::print("{}: {} recordings, {} frames, {:.1f} MB of raw data\n", options.target, exported.recordings,
             exported.frames, static_cast<double>(exported.sample_bytes) / 1e6);
  // What was asked for by name and is not there is a problem.
  return exported.absent.empty() || options.parts.empty() ? kWell : kProblemFound;
}

}  // namespace

void add_export(CLI::App& app, Work& work) {
  auto options = std::make_shared<ExportOptions>();
  CLI::App* verb =
      app.add_subcommand("export", "Write a campaign as a campaign folder, or for Python, MATLAB and Octave");
  verb->footer(
      "The target must not exist; a folder may be empty. It appears whole or not at all. Importing a "
      "campaign "
      "folder gives the same campaign; the other formats hold raw and calibrated series, coefficients, maps "
      "and "
      "models with their units, and docs/exports.md has their layout.\n\n"
      "Examples: tunnelrig export --db my.db my_campaign\n"
      "          tunnelrig export --db my.db --format hdf5 my.h5\n"
      "          tunnelrig export --db my.db --format mat --parts coefficients,maps my.mat");
  verb->add_option("target", options->target, "Folder (folder, csv, npy) or file (hdf5, mat) to make")
      ->required();
  verb->add_option("--db", options->db, "Campaign file")->required();
  verb->add_option("--format", options->format, "folder, hdf5, mat, csv or npy")->capture_default_str();
  verb->add_option("--parts", options->parts,
                   "Some of raw,thrusts,coefficients,maps,models; all where none is named")
      ->option_text("LIST");
  add_model_options(*verb, options->model, options->terms);
  verb->callback([options, &work] { work = [options] { return run_export(*options); }; });
}

}  // namespace tunnelrig::cli
