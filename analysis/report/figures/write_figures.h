// The paper's figures: what `report --figures` leaves behind (docs/report.md).
#pragma once

#include "analysis/report/report_data.h"

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace tunnelrig {

enum class FigureFormat { kPdf, kSvg, kPng };

/// "pdf", "svg", "png": also the end of a file's name.
std::string name_of(FigureFormat format);

/// The format of that name; throws InputError naming the three that there are.
FigureFormat figure_format(const std::string& name);

constexpr double kLeastFigureWidth_mm = 60, kGreatestFigureWidth_mm = 400;
constexpr int kFigureDotsPerInch = 600;  // of PNG

struct FigureSettings {
  FigureFormat format = FigureFormat::kPdf;
  double width_mm = 84;             // a column of most journals; fonts keep their size whatever the width
  std::string command;              // that makes the figures again, for captions.md
  std::string gnuplot = "gnuplot";  // the program that draws
  std::function<void(std::size_t done, std::size_t total)> progress = {};  // of figures
};

/// A figure that a campaign has no data for, with the reason.
struct AbsentFigure {
  std::string figure, reason;
};

struct WrittenFigures {
  std::vector<std::filesystem::path> files;  // captions.md is the last one
  std::vector<AbsentFigure> absent;
};

/// Writes into `folder`, which is made where it is missing, every figure that the campaign (and the flights,
/// where the settings name some) has data for, and captions.md, which says of each what it shows, what its
/// bars are, and the command that makes it again. Files of these names are replaced, all or none.
///
/// Throws InputError for a width outside the two above, a folder that cannot be written, a file that no
/// figure can be made of, and where gnuplot is missing or fails, with its reason.
WrittenFigures write_figures(const std::filesystem::path& folder, const CampaignFile& file,
                             const ReportSettings& report, const FigureSettings& settings);

}  // namespace tunnelrig
