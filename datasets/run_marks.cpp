#include "datasets/run_marks.h"

#include "datasets/error.h"

#include <algorithm>

namespace tunnelrig {
namespace {

constexpr std::size_t kLongest = 500;

std::string cell_of(const CampaignFile& file, std::string_view run, std::string_view column) {
  return file.cell("runs", "run", run, column);
}

void set(CampaignFile& file, std::string_view run, std::string_view column, std::string_view text) {
  file.set_cell("runs", "run", run, column, text);
}

std::string with_note(std::string notes, const std::string& text) {
  if (!notes.empty()) notes += '\n';
  return notes + text;
}

}  // namespace

std::string one_line(std::string_view text) {
  std::string line(text.substr(0, kLongest));
  while (line.size() < text.size() && !line.empty() &&
         (static_cast<unsigned char>(text[line.size()]) & 0xC0) == 0x80)
    line.pop_back();  // the cut went through a character
  std::replace_if(
      line.begin(), line.end(), [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7F; },
      ' ');
  const auto first = line.find_first_not_of(' ');
  if (first == std::string::npos) return "";
  return line.substr(first, line.find_last_not_of(' ') - first + 1);
}

void exclude_run(CampaignFile& file, std::string_view run, std::string_view reason) {
  const std::string line = one_line(reason);
  if (line.empty()) throw InputError(fmt::format("run {}: a run is excluded for a reason; give one", run));
  file.atomically([&] {
    cell_of(file, run, "run");
    set(file, run, "excluded", line);
  });
}

void include_run(CampaignFile& file, std::string_view run) {
  file.atomically([&] {
    const std::string reason = cell_of(file, run, "excluded");
    if (reason.empty()) throw InputError(fmt::format("run {} is not excluded", run));
    set(file, run, "excluded", "");
    set(file, run, "note", with_note(cell_of(file, run, "note"), "was excluded: " + reason));
  });
}

void add_note(CampaignFile& file, std::string_view run, std::string_view text) {
  const std::string line = one_line(text);
  if (line.empty()) throw InputError(fmt::format("run {}: an empty note says nothing", run));
  file.atomically([&] { set(file, run, "note", with_note(cell_of(file, run, "note"), line)); });
}

bool mark_alarms(CampaignFile& file, std::string_view run, std::string_view alarms) {
  return file.atomically_if_free([&] {
    if (cell_of(file, run, "alarms") != alarms) set(file, run, "alarms", alarms);
  });
}

}  // namespace tunnelrig
