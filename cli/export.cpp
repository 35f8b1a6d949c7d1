#include "cli/console.h"
#include "cli/verb.h"
#include "datasets/campaign_folder.h"

#include <memory>

#include <fmt/format.h>

namespace tunnelrig::cli {
namespace {

struct ExportOptions {
  std::string db, folder;
};

int run_export(const ExportOptions& options) {
  const CampaignFile file(options.db, CampaignFile::Access::kRead);
  ProgressBar bar("export");
  export_campaign_folder(file, options.folder, [&bar](std::size_t done, std::size_t total) {
    bar.show(static_cast<double>(done), static_cast<double>(total), fmt::format("run {} of {}", done, total));
  });
  fmt::print("{}: {} runs\n", options.folder, file.runs().size());
  return kWell;
}

}  // namespace

void add_export(CLI::App& app, Work& work) {
  auto options = std::make_shared<ExportOptions>();
  CLI::App* verb = app.add_subcommand("export", "Write a campaign file as a campaign folder");
  verb->footer(
      "The folder must not exist, or be empty. Importing it gives the same campaign.\n\nExample: tunnelrig "
      "export --db my.db my_campaign");
  verb->add_option("folder", options->folder, "Folder to make")->required();
  verb->add_option("--db", options->db, "Campaign file")->required();
  verb->callback([options, &work] { work = [options] { return run_export(*options); }; });
}

}  // namespace tunnelrig::cli
