#include "cli/console.h"

#include "cli/version.h"
#include "datasets/campaign.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>

#include <fmt/format.h>
#include <unistd.h>

namespace tunnelrig::cli {
namespace {

constexpr std::chrono::milliseconds kRedraw{100};
constexpr std::chrono::seconds kQuiet{2};
constexpr std::chrono::seconds kLineInterval{10};
constexpr std::size_t kBarWidth = 28;

std::string command_line;  // set once, at the start

bool is_numeric(const std::string& cell) {
  return !cell.empty() && (std::isdigit(static_cast<unsigned char>(cell[0])) != 0 || cell[0] == '-' ||
                           cell[0] == '+' || cell[0] == '.');
}

std::string bar_of(double fraction) {
  const auto filled = static_cast<std::size_t>(std::lround(fraction * kBarWidth));
  std::string bar;
  for (std::size_t i = 0; i < kBarWidth; ++i) bar += i < filled ? "█" : "░";
  return bar;
}

}  // namespace

std::string program_version() { return kProgramVersion; }

void remember_arguments(int argc, const char* const* argv) {
  for (int i = 0; i < argc; ++i) {
    const std::string argument = argv[i];
    const bool quoted = argument.empty() || argument.find_first_of(" \t\"'\\$*?") != std::string::npos;
    command_line += (i == 0 ? "" : " ") + (i == 0   ? std::string("tunnelrig")
                                           : quoted ? "'" + argument + "'"
                                                    : argument);
  }
}

const std::string& arguments() { return command_line; }

std::string now_utc() { return format_utc(std::floor(utc_seconds())); }

namespace {

/// https://no-color.org
bool colours_wanted() {
  const char* without = std::getenv("NO_COLOR");  // NOLINT(concurrency-mt-unsafe): nobody sets it meanwhile
  return without == nullptr || *without == '\0';
}

}  // namespace

bool error_is_coloured() { return error_is_terminal() && colours_wanted(); }
bool output_is_coloured() { return ::isatty(STDOUT_FILENO) != 0 && colours_wanted(); }
bool error_is_terminal() { return ::isatty(STDERR_FILENO) != 0; }
bool input_is_terminal() { return ::isatty(STDIN_FILENO) != 0; }

void tell(const std::string& text) {
  std::fputs(text.c_str(), stderr);  // fmt::print would throw
  std::fflush(stderr);
}

void warn(const std::string& text) {
  const bool colour = error_is_coloured();
  tell(fmt::format("{}warning:{} {}\n", colour ? "\x1b[33m" : "", colour ? "\x1b[0m" : "", text));
}

std::size_t display_width(std::string_view text) {
  // Every code point that the suite prints is one column wide, save combining marks (the macron of ȳ as y +
  // U+0304).
  std::size_t width = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto byte = static_cast<unsigned char>(text[i]);
    const bool combining = byte == 0xCC || (byte == 0xCD && i + 1 < text.size() &&
                                            static_cast<unsigned char>(text[i + 1]) < 0xB0);
    if ((byte & 0xC0u) != 0x80 && !combining) ++width;
  }
  return width;
}

void Table::print() const {
  std::vector<std::size_t> widths;
  for (const std::string& header : headers_) widths.push_back(display_width(header));
  for (const auto& row : rows_) {
    for (std::size_t c = 0; c < row.size(); ++c) widths[c] = std::max(widths[c], display_width(row[c]));
  }
  const auto line = [&](const std::vector<std::string>& cells, const auto& right) {
    std::string out;
    for (std::size_t c = 0; c < cells.size(); ++c) {
      const std::string pad(widths[c] - display_width(cells[c]), ' ');
      out += (c == 0 ? "" : "  ") + (right(c) ? pad + cells[c] : cells[c] + pad);
    }
    out.erase(out.find_last_not_of(' ') + 1);
    fmt::print("{}\n", out);
  };
  const auto numeric_column = [&](std::size_t c) {
    return std::any_of(rows_.begin(), rows_.end(), [&](const auto& row) { return is_numeric(row[c]); });
  };
  line(headers_, numeric_column);
  for (const auto& row : rows_) line(row, numeric_column);
}

ProgressBar::~ProgressBar() {
  if (drawn_ && error_is_terminal()) tell("\r\x1b[K");
}

bool ProgressBar::is_time_to_draw() {
  const auto now = Clock::now();
  const Clock::duration interval = error_is_terminal() ? Clock::duration(kRedraw) : kLineInterval;
  if (now - started_ < kQuiet || now - last_ < interval) return false;
  last_ = now;
  drawn_ = true;
  return true;
}

void ProgressBar::show(double done, double total, const std::string& note) {
  if (!is_time_to_draw()) return;
  const double fraction = total > 0 ? std::clamp(done / total, 0.0, 1.0) : 0;
  const double elapsed_s = std::chrono::duration<double>(last_ - started_).count();
  const std::string left =
      fraction > 0.01 ? duration_text(elapsed_s / fraction * (1 - fraction)) + " left" : "";
  if (error_is_terminal()) {
    tell(fmt::format("\r\x1b[K{} {} {:3.0f} %  {}  {}", what_, bar_of(fraction), 100 * fraction, left, note));
  } else {
    tell(fmt::format("{} {:.0f} %  {}  {}\n", what_, 100 * fraction, left, note));
  }
}

void ProgressBar::show(const std::string& note) {
  if (!is_time_to_draw()) return;
  const double elapsed_s = std::chrono::duration<double>(last_ - started_).count();
  const std::string text = fmt::format("{} for {}  {}", what_, duration_text(elapsed_s), note);
  tell(error_is_terminal() ? "\r\x1b[K" + text : text + "\n");
}

std::function<void(std::size_t done, std::size_t total)> show_on(ProgressBar& bar, const char* what) {
  return [&bar, what](std::size_t done, std::size_t total) {
    bar.show(static_cast<double>(done), static_cast<double>(total),
             fmt::format("{} {} of {}", what, done, total));
  };
}

std::string duration_text(double seconds) {
  if (seconds < 60) return fmt::format("{:.0f} s", seconds);
  if (seconds < 3600)
    return fmt::format("{:.0f} min {:02.0f} s", std::floor(seconds / 60),
                       std::floor(seconds - 60 * std::floor(seconds / 60)));
  return fmt::format("{:.0f} h {:02.0f} min", std::floor(seconds / 3600),
                     std::floor((seconds - 3600 * std::floor(seconds / 3600)) / 60));
}

}  // namespace tunnelrig::cli
