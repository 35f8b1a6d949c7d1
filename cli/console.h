// What the verbs share towards the person (or program) that called them.
#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace tunnelrig::cli {

/// kBadInput also where there is no room to write.
enum ExitCode { kWell = 0, kProblemFound = 1, kBadInput = 2 };

/// The version that provenance names.
std::string program_version();

/// The command line as it was typed, for provenance.
void remember_arguments(int argc, const char* const* argv);
const std::string& arguments();

/// "2026-03-02T08:00:00Z": when a page was made.
std::string now_utc();

bool error_is_terminal();

/// Whether what is said on standard error, or output, is to be coloured: on a terminal, unless NO_COLOR is
/// set.
bool error_is_coloured();
bool output_is_coloured();

bool input_is_terminal();

/// On standard error, where that can be written: a log on a full disk or a terminal that is gone must not end
/// a recording.
void tell(const std::string& text);

/// A line on standard error: "warning: …", coloured on a terminal.
void warn(const std::string& text);

/// A table on standard output, columns aligned; headers carry the units. Cells that start with a digit, sign
/// or point are set flush right.
class Table {
 public:
  explicit Table(std::vector<std::string> headers) : headers_(std::move(headers)) {}
  void add(std::vector<std::string> cells) { rows_.push_back(std::move(cells)); }
  void print() const;

 private:
  std::vector<std::string> headers_;
  std::vector<std::vector<std::string>> rows_;
};

/// Progress on standard error: a bar that is redrawn on a terminal, a line every ten seconds elsewhere.
/// Silent for work of less than two seconds.
class ProgressBar {
 public:
  explicit ProgressBar(std::string what) : what_(std::move(what)), started_(Clock::now()) {}
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  /// `note` stands behind the bar.
  void show(double done, double total, const std::string& note = {});
  /// Of work of which nobody knows how much there is.
  void show(const std::string& note);

 private:
  using Clock = std::chrono::steady_clock;

  bool is_time_to_draw();

  std::string what_;
  Clock::time_point started_;
  Clock::time_point last_{};
  bool drawn_ = false;
};

/// Shows what work says of itself: "run 3 of 12", of whatever `what` is. The bar must outlive the work.
std::function<void(std::size_t done, std::size_t total)> show_on(ProgressBar& bar, const char* what = "run");

/// "3 min 20 s"
std::string duration_text(double seconds);

/// Number of columns that a UTF-8 text takes on a terminal.
std::size_t display_width(std::string_view text);

}  // namespace tunnelrig::cli
