#include "daq/faults.h"

#include "datasets/csv.h"
#include "datasets/error.h"

#include <array>
#include <string_view>
#include <utility>

namespace tunnelrig {
namespace {

double require_number(std::string_view text, std::string_view item, double highest) {
  const auto value = parse_number(text);
  if (value && *value >= 0 && *value <= highest) return *value;
  throw InputError(fmt::format("--faults: '{}': a number from 0 to {:g} is required", item, highest));
}

void parse_item(std::string_view item, Faults& faults) {
  const auto equals = item.find('=');
  const std::string_view name = item.substr(0, equals);
  const std::string_view value =
      equals == std::string_view::npos ? std::string_view() : item.substr(equals + 1);
  const std::array<std::pair<std::string_view, double*>, 6> rates = {{{"drop", &faults.drop},
                                                                      {"duplicate", &faults.duplicate},
                                                                      {"reorder", &faults.reorder},
                                                                      {"corrupt", &faults.corrupt},
                                                                      {"truncate", &faults.truncate},
                                                                      {"garbage", &faults.garbage}}};
  for (const auto& [known, rate] : rates) {
    if (name == known) {
      *rate = require_number(value, item, 1);
      return;
    }
  }
  if (name != "stall" && name != "reboot") {
    throw InputError(fmt::format(
        "--faults: '{}' is none of drop duplicate reorder corrupt truncate garbage stall reboot", name));
  }
  const auto colon = value.find(':');
  if (colon == std::string_view::npos)
    throw InputError(fmt::format("--faults: '{}': when and for how long, in seconds: {}=2:1.5", item, name));
  const double at_s = require_number(value.substr(0, colon), item, 1e6);
  const double for_s = require_number(value.substr(colon + 1), item, 1e6);
  (name == "stall" ? faults.stall_at_s : faults.reboot_at_s) = at_s;
  (name == "stall" ? faults.stall_s : faults.reboot_s) = for_s;
}

}  // namespace

Faults parse_faults(const std::string& text) {
  Faults faults;
  std::string_view rest = text;
  while (!rest.empty()) {
    const auto comma = rest.find(',');
    parse_item(rest.substr(0, comma), faults);
    rest = comma == std::string_view::npos ? std::string_view() : rest.substr(comma + 1);
  }
  return faults;
}

}  // namespace tunnelrig
