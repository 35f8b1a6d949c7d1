#include "analysis/report/render.h"
#include "analysis/report/report_data.h"
#include "cli/console.h"
#include "cli/verb.h"
#include "datasets/csv.h"

#include <memory>

#include <fmt/format.h>

namespace tunnelrig::cli {
namespace {

struct ReportOptions {
  std::string db, out, model, terms, flights;
};

int run_report(const ReportOptions& options) {
  const CampaignFile file(options.db, CampaignFile::Access::kRead);
  const ReportSettings settings{.db = options.db,
                                .program_version = program_version(),
                                .arguments = arguments(),
                                .created_utc = now_utc(),
                                .model = choose_model(file, options.model, options.terms),
                                .flights = options.flights};
  ProgressBar bar("report");
  const ReportData data = report_data(file, settings, [&bar](std::size_t done, std::size_t total) {
    bar.show(static_cast<double>(done), static_cast<double>(total), fmt::format("run {} of {}", done, total));
  });
  const std::string page = render_report(data.json);
  write_text(options.out, page);
  for (const AbsentSection& section : data.absent)
    fmt::print("without {}: {}\n", section.section, section.reason);
  fmt::print("{}: {:.1f} MB, opens in any browser, without a network\n", options.out,
             static_cast<double>(page.size()) / 1e6);
  return kWell;
}

}  // namespace

void add_report(CLI::App& app, Work& work) {
  auto options = std::make_shared<ReportOptions>();
  CLI::App* verb =
      app.add_subcommand("report", "One self-contained page: maps, coefficients, health, provenance");
  verb->footer(
      "The page needs no network and no other file; docs/report.md. A section that the campaign has no data "
      "for says why. Nothing is stored in the campaign file.\n\n"
      "Examples: tunnelrig report --db my.db --out report.html\n"
      "          tunnelrig report --db my.db --out report.html --flights flights/flights.json");
  verb->add_option("--db", options->db, "Campaign file")->required();
  verb->add_option("--out", options->out, "The page (.html)")->required();
  verb->add_option("--flights", options->flights,
                   "flights.json of `tunnelrig fly --out`, for a section of its own");
  add_model_options(*verb, options->model, options->terms);
  verb->callback([options, &work] { work = [options] { return run_report(*options); }; });
}

}  // namespace tunnelrig::cli
