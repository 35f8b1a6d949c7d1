#include "analysis/report/figures/sheet.h"

#include "analysis/report/figures/embedded_font.h"
#include "datasets/error.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include <fmt/format.h>

namespace tunnelrig {

std::string name_of(FigureFormat format) {
  constexpr std::array kNames = {"pdf", "svg", "png"};
  return kNames[static_cast<std::size_t>(format)];
}

FigureFormat figure_format(const std::string& name) {
  for (const FigureFormat format : {FigureFormat::kPdf, FigureFormat::kSvg, FigureFormat::kPng}) {
    if (name == name_of(format)) return format;
  }
  throw InputError(fmt::format("'{}' is no format of figures; there are pdf, svg and png", name));
}

namespace report {
namespace {

constexpr double kMillimetresPerInch = 25.4;
constexpr double kPango = 72.0 / 96;  // gnuplot's cairo takes a font's points for those of a screen

/// CRC-32 of a PNG's chunk (ISO/IEC 15948, annex D).
std::uint32_t png_crc(std::string_view bytes) {
  std::uint32_t crc = 0xFFFFFFFFu;
  for (const char byte : bytes) {
    crc ^= static_cast<unsigned char>(byte);
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 1u) != 0 ? 0xEDB88320u ^ (crc >> 1u) : crc >> 1u;
  }
  return ~crc;
}

std::string big_endian(std::uint32_t value) {
  std::string bytes;
  for (const unsigned shift : {24u, 16u, 8u, 0u}) bytes += static_cast<char>((value >> shift) & 0xFFu);
  return bytes;
}

/// The chunk pHYs, which belongs between the header and the image data.
std::string dots_per_metre() {
  const auto dots = static_cast<std::uint32_t>(std::lround(kFigureDotsPerInch / kMillimetresPerInch * 1e3));
  const std::string chunk = "pHYs" + big_endian(dots) + big_endian(dots) + '\1';
  return big_endian(9) + chunk + big_endian(png_crc(chunk));
}

}  // namespace

std::string Sheet::axes(const Box& box, const std::string& below, const std::string& left,
                        double left_distance_mm) const {
  constexpr double kBelowDistance_mm = 7;
  const double middle_x = x((box.left_mm + box.right_mm) / 2), middle_y = y((box.bottom_mm + box.top_mm) / 2);
  return fmt::format(
      "set lmargin at screen {:.5f}\nset rmargin at screen {:.5f}\n"
      "set bmargin at screen {:.5f}\nset tmargin at screen {:.5f}\n"
      "set label 101 {} at screen {:.5f},{:.5f} center\n"
      "set label 102 {} at screen {:.5f},{:.5f} center rotate by 90\n",
      x(box.left_mm), x(box.right_mm), y(box.bottom_mm), y(box.top_mm), gnuplot_text(below), middle_x,
      y(box.bottom_mm - kBelowDistance_mm), gnuplot_text(left), x(box.left_mm - left_distance_mm), middle_y);
}

std::string terminal(const Sheet& sheet, FigureFormat format, const std::string& file) {
  const auto units = [&](double per_inch) {
    return fmt::format("{},{}", std::lround(sheet.width_mm / kMillimetresPerInch * per_inch),
                       std::lround(sheet.height_mm / kMillimetresPerInch * per_inch));
  };
  const std::string output = fmt::format("\nset output {}\n", gnuplot_text(file));
  if (format == FigureFormat::kPdf) {
    return fmt::format("set terminal pdfcairo size {:.4f}cm,{:.4f}cm font 'sans,{}' fontscale {} linewidth 1",
                       sheet.width_mm / 10, sheet.height_mm / 10, kFont_pt, kPango) +
           output;
  }
  if (format == FigureFormat::kSvg) {
    // A unit is a point: sizes of fonts that a script names are not scaled.
    return fmt::format("set terminal svg size {} font {} linewidth 0.5 background 'white'", units(72),
                       gnuplot_text(fmt::format("{},{}", figure_font_family(), kFont_pt))) +
           output;
  }
  constexpr double kDot = kFigureDotsPerInch / 72.0;
  return fmt::format(
             "set terminal pngcairo size {} font 'sans,{}' fontscale {:.4f} linewidth {:.4f} "
             "dashlength 2 pointscale {:.4f}",
             units(kFigureDotsPerInch), kFont_pt, kDot * kPango, kDot / 2, kDot) +
         output;
}

std::string look() {
  return fmt::format(
      "reset\nset encoding utf8\nset minussign\nset border linewidth 0.5\n"
      "set tics out nomirror font ',{0}' scale 0.5\nset grid linewidth 0.3 linecolor rgb '#d0d0d0'\n"
      "set xtics offset 0,0.3\nset key font ',{0}' samplen 1.2 spacing 0.9 noenhanced\nset bars 0.4\nunset "
      "key\n",
      kSmallFont_pt);
}

double point_size(int point) { return point == 5 || point == 7 ? 0.35 : 0.5; }

std::string legend(const Sheet& sheet, const std::vector<LegendEntry>& entries, double top_mm, int columns,
                   double left_mm, int first) {
  constexpr double kSample_mm = 5;
  const double column_mm = (sheet.width_mm - left_mm) / columns;
  std::string text;
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const LegendEntry& entry = entries[i];
    const int row = static_cast<int>(i) / columns, column = static_cast<int>(i) % columns;
    const int number = first + 2 * static_cast<int>(i);
    const double x_mm = left_mm + column * column_mm, y_mm = top_mm - row * kLegendRow_mm;
    text += fmt::format(
        "set arrow {} from screen {:.5f},{:.5f} to screen {:.5f},{:.5f} nohead linecolor rgb '{}' linewidth "
        "{} "
        "dashtype {} front\n",
        number, sheet.x(x_mm), sheet.y(y_mm), sheet.x(x_mm + kSample_mm), sheet.y(y_mm), entry.colour,
        entry.dash == 0 ? 12 : entry.line_width, std::max(entry.dash, 1));
    if (entry.point > 0)
      text += fmt::format(
          "set label {} '' at screen {:.5f},{:.5f} point pointtype {} pointsize {} linecolor rgb '{}'\n",
          number, sheet.x(x_mm + kSample_mm / 2), sheet.y(y_mm), entry.point, point_size(entry.point),
          entry.colour);
    text +=
        fmt::format("set label {} {} at screen {:.5f},{:.5f} left font ',{}' noenhanced\n", number + 1,
                    gnuplot_text(entry.text), sheet.x(x_mm + kSample_mm + 1.2), sheet.y(y_mm), kSmallFont_pt);
  }
  return text;
}

std::string completed(std::string file, const Sheet& sheet, FigureFormat format) {
  if (format == FigureFormat::kPng) {
    constexpr std::size_t kHeaderEnd = 8 + 4 + 4 + 13 + 4;  // signature, and the chunk IHDR
    return file.insert(kHeaderEnd, dots_per_metre());
  }
  if (format == FigureFormat::kSvg) {
    const auto from = file.find(" width=\"");
    const auto to = file.find('\n', from);
    file.replace(from, to - from,
                 fmt::format(" width=\"{:g}mm\" height=\"{:g}mm\"", sheet.width_mm, sheet.height_mm));
    return with_embedded_font(std::move(file));
  }
  return file;
}

}  // namespace report
}  // namespace tunnelrig
