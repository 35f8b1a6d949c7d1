#include "analysis/maps/picture.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

namespace tunnelrig {
namespace {

/// The lines on one side of ȳ = 0, which no segment crosses: it is a column of the grid.
std::vector<ContourLine> lines_of_half(const std::vector<ContourLine>& lines, bool right) {
  std::vector<ContourLine> parts;
  for (const ContourLine& line : lines) {
    ContourLine part{.level = line.level};
    for (std::size_t i = 0; i + 1 < line.points.size(); ++i) {
      const double middle = line.points[i].y_norm + line.points[i + 1].y_norm;
      if (right ? middle >= 0 : middle < 0) {
        if (part.points.empty()) part.points.push_back(line.points[i]);
        part.points.push_back(line.points[i + 1]);
      } else if (!part.points.empty()) {
        parts.push_back(std::exchange(part, {.level = line.level}));
      }
    }
    if (!part.points.empty()) parts.push_back(part);
  }
  return parts;
}

/// Without the specks that the uncertainty has around single locations, where each pulls it down: the cross
/// says as much.
std::vector<ContourLine> without_specks(std::vector<ContourLine> lines) {
  constexpr double kSpeck = 0.15;
  std::erase_if(lines, [](const ContourLine& line) {
    const auto extent = [&line](double TunnelPoint::*axis) {
      const auto [least, greatest] = std::minmax_element(
          line.points.begin(), line.points.end(),
          [axis](const TunnelPoint& a, const TunnelPoint& b) { return a.*axis < b.*axis; });
      return (*greatest).*axis - (*least).*axis;
    };
    return std::max(extent(&TunnelPoint::y_norm), extent(&TunnelPoint::z_norm)) < kSpeck;
  });
  return lines;
}

std::string polyline(const std::vector<TunnelPoint>& points) {
  std::string out;
  for (const TunnelPoint& point : points) out += fmt::format("{:.5f} {:.5f}\n", point.y_norm, point.z_norm);
  return out + "\n";
}

std::string polylines(const std::vector<ContourLine>& lines) {
  std::string out;
  for (const ContourLine& line : lines) out += polyline(line.points);
  return out;
}

/// Drawn as lines, which both terminals draw alike; points they do not.
std::string crosses(const std::vector<TunnelPoint>& locations) {
  constexpr double kArm = 0.017;
  std::string out;
  for (const auto& [y, z] : locations) {
    for (const double slope : {-kArm, kArm}) {
      out += fmt::format("{:.5f} {:.5f}\n{:.5f} {:.5f}\n\n", y - kArm, z - slope, y + kArm, z + slope);
    }
  }
  return out;
}

std::string field(const Picture& picture) {
  std::string out;
  for (std::size_t row = 0; row < picture.grid.z_norm.size(); ++row) {
    for (std::size_t column = 0; column < picture.grid.y_norm.size(); ++column) {
      out += fmt::format("{:.5f} {:.5f} {:.6g}\n", picture.grid.y_norm[column], picture.grid.z_norm[row],
                         picture.values[picture.grid.index(row, column)]);
    }
  }
  return out;
}

std::string labels(const std::vector<ContourLabel>& list, bool with_sign) {
  std::string out;
  for (const ContourLabel& label : list) {
    const char* sign = label.level < 0 ? "−" : with_sign && label.level > 0 ? "+" : "";
    out += fmt::format("{:.5f} {:.5f} \"{}{:g}\"\n", label.at.y_norm, label.at.z_norm, sign,
                       std::abs(label.level));
  }
  return out;
}

/// Of the colours: from −end, or from 0, to end.
struct BarRange {
  double step = 0, end = 0;
  int decimals = 0;  // of its numbers
};

BarRange bar_range(const Picture& picture) {
  constexpr int kMostDecimals = 12;
  double greatest = 1e-6;
  for (const double value : picture.values) greatest = std::max(greatest, std::abs(value));
  BarRange bar{.step = nice_step(greatest / 5)};
  bar.end = bar.step * std::ceil(greatest / bar.step);
  for (double whole = bar.step;
       std::abs(whole - std::round(whole)) > 1e-6 * whole && bar.decimals < kMostDecimals; whole *= 10)
    ++bar.decimals;
  return bar;
}

/// Colours and their range. Diverging: ColorBrewer's RdBu, white at 0; seen without the medium-wave cones
/// (Machado et al. 2009) it runs from blue to brown with monotonic lightness on either side. Sequential: a
/// straight line in CIELAB from white, in which equal steps look equal, with and without those cones.
std::string colours(const Picture& picture) {
  const BarRange bar = bar_range(picture);
  const char* palette =
      picture.diverging
          ? "0 '#2166ac', 1 '#4393c3', 2 '#92c5de', 3 '#d1e5f0', 4 '#f7f7f7', 5 '#fddbc7', 6 '#f4a582', "
            "7 '#d6604d', 8 '#b2182b'"
          : "0 '#f9f9f9', 1 '#eae6f1', 2 '#dad2ea', 3 '#cabfe2', 4 '#bbacda', 5 '#ab9ad2', 6 '#9b88ca', "
            "7 '#8a76c1', 8 '#7a64b9'";
  // Below a ten-thousandth gnuplot goes over to powers of ten, of which nobody knows how wide they are.
  const std::string format = bar.step < 1e-4 ? fmt::format("set format cb '%.{}f'\n", bar.decimals) : "";
  return fmt::format("set palette defined ({})\nset cbrange [{:.6g}:{:.6g}]\nset cbtics {:.6g}\n{}", palette,
                     picture.diverging ? -bar.end : 0, bar.end, bar.step, format);
}

std::string margins(const PictureFrame& frame) {
  return fmt::format(
      "set lmargin at screen {0:.5f}\nset rmargin at screen {1:.5f}\n"
      "set bmargin at screen {2:.5f}\nset tmargin at screen {3:.5f}\n"
      "set xrange [-1:1]\nset yrange [-1:1]\n"
      "set colorbox user origin screen {4:.5f},{2:.5f} size screen {5:.5f},{6:.5f}\n",
      frame.left, frame.right, frame.bottom, frame.top, frame.bar_left, frame.bar_width,
      frame.top - frame.bottom);
}

/// Both pairs of axes: normalised coordinates, and metres from the tunnel's centre (4.1, 4.2).
std::string axes_in_metres_too(const MapGeometry& geometry) {
  const double y_m = (geometry.tunnel_width_m - geometry.vehicle_width_m) / 2;
  const double z_m = (geometry.tunnel_height_m - geometry.vehicle_height_m) / 2;
  return fmt::format(
      "set x2range [-{0:.6g}:{0:.6g}]\nset y2range [-{1:.6g}:{1:.6g}]\n"
      "set xtics -1,0.5,1 nomirror out\nset ytics -1,0.5,1 nomirror out\n"
      "set x2tics {2:.6g} out offset 0,-0.3\nset y2tics {3:.6g} out offset -0.3,0\n"
      "set xlabel '← wall              ȳ = 2y / (w_t − w_q)              wall →'\n"
      "set ylabel '← ground             z̄ = 2z / (h_t − h_q)             ceiling →'\n"
      "set x2label 'y (m)' offset 0,-0.5\nset y2label 'z (m)' offset -1,0\n",
      y_m, z_m, nice_step(y_m / 4), nice_step(z_m / 4));
}

std::string plain_axes() { return "set xtics -1,0.5,1 nomirror out\nset ytics -1,0.5,1 nomirror out\n"; }

/// A line of the title; on that of the note there is no room for both.
std::string legend(bool dashed, bool hatched) {
  if (!dashed && !hatched) return "";
  return fmt::format("\\n{{/*0.8 {}{}{}}}", dashed ? "dashed: mirrored" : "", dashed && hatched ? "; " : "",
                     hatched ? "hatched: beyond the locations" : "");
}

std::string plot(bool hatched, bool dashed, double scale) {
  std::string command = "plot $field using 1:2:3 with image notitle";
  if (hatched)
    command +=
        fmt::format(", $hatching with lines linecolor rgb '#707070' linewidth {:.3g} notitle", 0.9 * scale);
  if (dashed)
    command +=
        fmt::format(", $mirrored with lines linecolor rgb '#303030' linewidth {:.3g} dashtype (9,6) notitle",
                    1.3 * scale);
  return command + fmt::format(
                       ", $measured with lines linecolor rgb '#101010' linewidth {:.3g} notitle"
                       ", $crosses with lines linecolor rgb 'white' linewidth {:.3g} notitle"
                       ", $crosses with lines linecolor rgb '#101010' linewidth {:.3g} notitle"
                       ", $labels using 1:2:3 with labels boxed notitle\n",
                       1.6 * scale, 5 * scale, 2 * scale);
}

/// The lines of the halves that were measured, and of those that are their mirror images.
struct Halves {
  std::vector<ContourLine> measured, mirrored;
};

Halves halves_of(const Picture& picture) {
  const auto on_side = [&](double sign) {
    return std::any_of(picture.locations.begin(), picture.locations.end(),
                       [&](const TunnelPoint& point) { return sign * point.y_norm > 0; });
  };
  const std::vector<ContourLine> drawn = picture.diverging ? picture.lines : without_specks(picture.lines);
  Halves halves;
  for (const bool right : {false, true}) {
    std::vector<ContourLine>& half = on_side(right ? 1 : -1) ? halves.measured : halves.mirrored;
    for (ContourLine& line : lines_of_half(drawn, right)) half.push_back(std::move(line));
  }
  return halves;
}

constexpr int kWidth_px = 1100, kHeight_px = 960;

/// So much wider is the picture where the numbers on the bar are long, so that they do not run into its
/// title.
int more_width_px(const Picture& picture) {
  constexpr int kLettersThatFit = 5, kLetter_px = 16;
  return kLetter_px * std::max(0, bar_letters(picture) - kLettersThatFit);
}

/// The usual frame, on a canvas that is wider on the right.
PictureFrame widened(int more_px) {
  PictureFrame frame;
  const double share = static_cast<double>(kWidth_px) / (kWidth_px + more_px);
  for (double* across : {&frame.left, &frame.right, &frame.bar_left, &frame.bar_width}) *across *= share;
  frame.bar_label = 1 - share * (1 - frame.bar_label);
  return frame;
}

}  // namespace

int bar_letters(const Picture& picture) {
  const BarRange bar = bar_range(picture);
  return static_cast<int>(fmt::format("{:.{}f}", bar.end, bar.decimals).size()) + (picture.diverging ? 1 : 0);
}

DrawnPicture draw_picture(const Picture& picture, const PictureFrame& frame) {
  const Halves halves = halves_of(picture);
  const bool dashed = !halves.mirrored.empty(), hatched = !picture.hatching.empty();
  const auto block = [](const char* name, const std::string& lines) {
    return fmt::format("${} << END\n{}END\n", name, lines);
  };
  const auto labelled = place_labels(halves.measured, picture.locations, frame.label);
  std::string setup =
      "reset\nset encoding utf8\nset minussign\nset style textbox opaque noborder margins 0.4,0.4\n";
  setup += block("field", field(picture)) + block("measured", polylines(halves.measured)) +
           block("mirrored", polylines(halves.mirrored)) + block("crosses", crosses(picture.locations)) +
           block("labels", labels(labelled, picture.diverging));
  if (hatched) {
    std::string lines;
    for (const std::vector<TunnelPoint>& line : picture.hatching) lines += polyline(line);
    setup += block("hatching", lines);
  }
  setup += colours(picture) + margins(frame);
  setup += frame.titled ? axes_in_metres_too(picture.geometry) : plain_axes();
  if (frame.titled)
    setup += fmt::format("set title \"{}\\n{{/*0.8 {}}}{}\"\n", picture.title, picture.note,
                         legend(dashed, hatched));
  // Not as cblabel, which long numbers on the bar push out of the picture.
  setup += fmt::format("set label '{}' at screen {:.5f},{:.5f} center rotate by 90\n", picture.colour_label,
                       frame.bar_label, (frame.bottom + frame.top) / 2);
  return {setup, plot(hatched, dashed, frame.line_scale)};
}

std::string gnuplot_script(const Picture& picture, const std::string& stem) {
  const int more_px = more_width_px(picture);
  const DrawnPicture drawn = draw_picture(picture, widened(more_px));
  std::string script = drawn.setup;
  for (const auto& [terminal, font_size] : {std::pair{"svg", 20}, std::pair{"pngcairo", 18}}) {  // look alike
    script += fmt::format(
        "set terminal {} size {},{} font 'sans-serif,{}'\nset output '{}.{}'\n{}unset output\n", terminal,
        kWidth_px + more_px, kHeight_px, font_size, stem, std::string(terminal).substr(0, 3), drawn.plot);
  }
  return script;
}

}  // namespace tunnelrig
