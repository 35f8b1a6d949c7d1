#include "analysis/report/figures/write_figures.h"
#include "analysis/report/render.h"
#include "analysis/report/report_data.h"
#include "cli/console.h"
#include "cli/verb.h"
#include "datasets/csv.h"
#include "datasets/error.h"

#include <memory>

#include <fmt/format.h>

namespace tunnelrig::cli {
namespace {

struct ReportOptions {
  std::string db, out, model, terms, flights, figures, format = "pdf";
  double width_mm = FigureSettings{}.width_mm;
};

void write_page(const ReportOptions& options, const CampaignFile& file, const ReportSettings& settings) {
  ProgressBar bar("report");
  const ReportData data = report_data(file, settings, show_on(bar));
  const std::string page = render_report(data.json);
  write_text(options.out, page);
  for (const AbsentSection& section : data.absent)
    fmt::print("without {}: {}\n", section.section, section.reason);
  fmt::print("{}: {:.1f} MB, opens in any browser, without a network\n", options.out,
             static_cast<double>(page.size()) / 1e6);
}

void write_all_figures(const ReportOptions& options, const CampaignFile& file,
                       const ReportSettings& settings) {
  ProgressBar bar("figures");
  const WrittenFigures written = write_figures(options.figures, file, settings,
                                               {.format = figure_format(options.format),
                                                .width_mm = options.width_mm,
                                                .command = arguments(),
                                                .progress = show_on(bar, "figure")});
  for (const AbsentFigure& figure : written.absent)
    fmt::print("without {}: {}\n", figure.figure, figure.reason);
  fmt::print("{} figures, {:g} mm wide{}, and captions.md in {}\n", written.files.size() - 1,
             options.width_mm,
             options.format == "png" ? fmt::format(" at {} dots per inch", kFigureDotsPerInch) : "",
             options.figures);
}

int run_report(const ReportOptions& options, const CLI::App& verb) {
  if (options.out.empty() && options.figures.empty())
    throw InputError("report: --out FILE (the page), --figures FOLDER, or both are required");
  if (options.figures.empty())
    refuse_given(verb, {"--format", "--width-mm"}, "says how figures are drawn; it goes with --figures");
  const CampaignFile file(options.db, CampaignFile::Access::kRead);
  const ReportSettings settings{.db = options.db,
                                .program_version = program_version(),
                                .arguments = arguments(),
                                .created_utc = now_utc(),
                                .model = choose_model(file, options.model, options.terms),
                                .flights = options.flights};
  if (!options.out.empty()) write_page(options, file, settings);
  if (!options.figures.empty()) write_all_figures(options, file, settings);
  return kWell;
}

}  // namespace

void add_report(CLI::App& app, Work& work) {
  auto options = std::make_shared<ReportOptions>();
  CLI::App* verb =
      app.add_subcommand("report", "One self-contained page of everything, and figures for a paper");
  verb->footer(
      "The page needs no network and no other file; docs/report.md. A section that the campaign has no data "
      "for says why. Nothing is stored in the campaign file.\n\n"
      "Examples: tunnelrig report --db my.db --out report.html\n"
      "          tunnelrig report --db my.db --out report.html --flights flights/flights.json\n"
      "          tunnelrig report --db my.db --figures figures --format pdf --width-mm 84");
  verb->add_option("--db", options->db, "Campaign file")->required();
  verb->add_option("--out", options->out, "The page (.html)");
  verb->add_option("--figures", options->figures,
                   "Folder for the paper's figures, a file each, with captions");
  verb->add_option("--format", options->format, "Of the figures; fonts are embedded in pdf and svg")
      ->check(CLI::IsMember({"pdf", "svg", "png"}))
      ->capture_default_str();
  verb->add_option("--width-mm", options->width_mm,
                   "Of the figures; their fonts are of 7 and 8 points at any width")
      ->check(CLI::Range(kLeastFigureWidth_mm, kGreatestFigureWidth_mm))
      ->capture_default_str();
  verb->add_option("--flights", options->flights,
                   "flights.json of `tunnelrig fly --out`, for a section of its own");
  add_model_options(*verb, options->model, options->terms);
  verb->callback([options, verb, &work] { work = [options, verb] { return run_report(*options, *verb); }; });
}

}  // namespace tunnelrig::cli
