#include "flight/lidar/carmen_log.h"

#include "datasets/csv.h"
#include "datasets/error.h"

#include <charconv>
#include <cmath>
#include <numbers>

namespace tunnelrig {
namespace {

constexpr std::size_t kMost_beams = 100000;

/// Words of one line, one after the other.
class Words {
 public:
  Words(std::string_view line, const std::string& file, int number)
      : rest_(line), file_(file), number_(number) {}

  std::string_view next() {
    const std::size_t start = rest_.find_first_not_of(" \t\r");
    if (start == std::string_view::npos) {
      rest_ = {};
      return {};
    }
    rest_.remove_prefix(start);
    const std::string_view word = rest_.substr(0, rest_.find_first_of(" \t\r"));
    rest_.remove_prefix(word.size());
    return word;
  }

  double number(std::string_view what) {
    const std::string_view word = next();
    double value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (word.empty()) throw InputError::at(file_, number_, "the FLASER line ends before its {}", what);
    if (error != std::errc() || end != word.data() + word.size() || !std::isfinite(value))
      throw InputError::at(file_, number_, "FLASER: {} \"{}\" is not a finite number", what, word);
    return value;
  }

  PlanarPose pose(std::string_view what) {
    const double x = number(what);
    const double y = number(what);
    return {x, y, number(what)};
  }

 private:
  std::string_view rest_;
  const std::string& file_;
  int number_;
};

CarmenScan flaser(Words words, const std::string& file, int line) {
  const double count = words.number("number of ranges");
  if (!(count >= 2 && count <= static_cast<double>(kMost_beams) && count == std::floor(count)))
    throw InputError::at(file, line, "FLASER: {} ranges: a whole number from 2 to {}", count, kMost_beams);
  CarmenScan scan;
  scan.line = line;
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    const double range_m = words.number("range");
    if (!(std::abs(range_m) < 1e6))
      throw InputError::at(file, line, "FLASER: a range of {} m: no LIDAR reaches so far", range_m);
    scan.scan.range_m.push_back(static_cast<float>(range_m));
  }
  scan.pose = words.pose("pose");
  scan.odometry = words.pose("odometry");
  scan.time_s = words.number("time");
  return scan;
}

}  // namespace

std::vector<CarmenScan> parse_carmen_log(std::string_view text, const std::string& file, LogTime time) {
  std::vector<CarmenScan> scans;
  int number = 0;
  while (!text.empty()) {
    const std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(text.size(), line.size() + 1));
    ++number;
    Words words(line, file, number);
    if (words.next() != "FLASER") continue;
    scans.push_back(flaser(words, file, number));
    if (scans.size() < 2 || time == LogTime::kAsLogged) continue;
    const CarmenScan& before = scans[scans.size() - 2];
    if (scans.back().time_s < before.time_s)
      throw InputError::at(file, number,
                           "FLASER: time {:.3f} s is before that of line {}, {:.3f} s: time goes forwards",
                           scans.back().time_s, before.line, before.time_s);
  }
  return scans;
}

std::vector<CarmenScan> read_carmen_log(const std::filesystem::path& path, LogTime time) {
  return parse_carmen_log(read_text(path), path.string(), time);
}

BeamLayout carmen_layout(std::size_t beams) {
  const auto count = static_cast<double>(beams);
  if (beams % 2 == 0) return {beams, std::numbers::pi / count / 2, std::numbers::pi / count};
  return {beams, 0, std::numbers::pi / (count - 1)};
}

}  // namespace tunnelrig
