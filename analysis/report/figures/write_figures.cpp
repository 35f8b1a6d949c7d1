#include "analysis/report/figures/write_figures.h"

#include "analysis/maps/gnuplot.h"
#include "analysis/maps/staging.h"
#include "analysis/report/figures/figures.h"
#include "datasets/csv.h"
#include "datasets/error.h"

#include <iterator>

#include <fmt/format.h>

namespace tunnelrig {
namespace {

using report::Figure;
using report::Figures;

constexpr const char* kCaptions = "captions.md";

void append(Figures part, Figures& all) {
  std::move(part.drawn.begin(), part.drawn.end(), std::back_inserter(all.drawn));
  std::move(part.absent.begin(), part.absent.end(), std::back_inserter(all.absent));
}

Figures all_figures(const CampaignFile& file, const ReportSettings& settings, double width_mm) {
  Figures all;
  if (file.text("table.toml")) {
    all.absent.push_back({"coefficients", "the file holds a table; `tunnelrig reduce --plot` draws it"});
  } else {
    const report::Material material = report::gather(file, settings);
    append(report::map_figures(material, width_mm), all);
    append(report::location_figures(material, width_mm), all);
    append(report::open_space_figures(material, width_mm), all);
    append(report::calibration_figures(material, width_mm), all);
    append(report::residual_figures(material, width_mm), all);
  }
  if (settings.flights.empty())
    all.absent.push_back({"flights", "no flights were given (--flights)"});
  else
    append(report::flight_figures(report::flights_section(settings.flights), width_mm), all);
  return all;
}

std::string captions(const std::vector<Figure>& figures, const ReportSettings& report,
                     const FigureSettings& settings) {
  std::string text = fmt::format(
      "Figures of {}, {} mm wide, made by\n\n    {}\n\nwith tunnelrig {}, {}; model: {}.\n", report.db,
      settings.width_mm, settings.command, report.program_version, report.created_utc, report.model.name());
  for (const Figure& figure : figures)
    text += fmt::format("\n**{}.{}**: {}\n", figure.name, name_of(settings.format), figure.caption);
  return text;
}

}  // namespace

WrittenFigures write_figures(const std::filesystem::path& folder, const CampaignFile& file,
                             const ReportSettings& report, const FigureSettings& settings) {
  if (!(settings.width_mm >= kLeastFigureWidth_mm && settings.width_mm <= kGreatestFigureWidth_mm)) {
    throw InputError(fmt::format("figures {:g} mm wide: the width must be from {:g} to {:g} mm",
                                 settings.width_mm, kLeastFigureWidth_mm, kGreatestFigureWidth_mm));
  }
  const Figures figures = all_figures(file, report, settings.width_mm);
  if (figures.drawn.empty()) {
    throw InputError::in(report.db, "there is no figure to draw: {}", figures.absent.front().reason);
  }
  const Staging staging(folder, "figures");
  std::vector<std::string> names;
  staging.write([&] {
    for (const Figure& figure : figures.drawn) {
      names.push_back(fmt::format("{}.{}", figure.name, name_of(settings.format)));
      const std::string script =
          report::terminal(figure.sheet, settings.format, names.back()) + figure.script + "unset output\n";
      if (const auto failed = run_gnuplot(settings.gnuplot, staging.path(), script))
        throw InputError(fmt::format("figures cannot be drawn: {}", *failed));
      const auto path = staging.path() / names.back();
      write_text(path, report::completed(read_text(path), figure.sheet, settings.format));
      if (settings.progress) settings.progress(names.size(), figures.drawn.size());
    }
    write_text(staging.path() / kCaptions, captions(figures.drawn, report, settings));
  });
  names.emplace_back(kCaptions);
  return {staging.publish(names), figures.absent};
}

}  // namespace tunnelrig
