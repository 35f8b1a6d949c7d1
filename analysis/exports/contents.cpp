#include "analysis/exports/contents.h"

#include "analysis/exports/table_builder.h"
#include "datasets/units.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <set>

namespace tunnelrig::exports {
namespace {

struct NameUnit {
  std::string_view ending, unit;
};

/// Endings of the suite's own, which come before those that users' columns may have: "_V_per_N" is not in
/// newtons.
constexpr std::array<NameUnit, 9> kUnits = {{{"_V_per_N", "V/N"},
                                             {"_N_per_V", "N/V"},
                                             {"_kg_m3", "kg/m^3"},
                                             {"_ppm_h", "ppm/h"},
                                             {"_humidity", "1"},
                                             {"_norm", "1"},
                                             {"_hz", "Hz"},
                                             {"_m2", "m^2"},
                                             {"_R", "propeller radii"}}};

/// What Octave cannot read, in ASCII.
constexpr std::array<NameUnit, 3> kInAscii = {{{"°C", "degC"}, {"°F", "degF"}, {"N·m", "N m"}}};

constexpr std::size_t kLongestName = 63;  // of MATLAB

struct Entry {
  std::string table, column, unit, meaning;
};

}  // namespace

std::size_t Table::rows() const {
  if (columns.empty()) return 0;
  return std::visit([](const auto& values) { return values.size(); }, columns.front().values);
}

std::size_t size_of(Element element) {
  switch (element) {
    case Element::kInt16:
    case Element::kUInt16:
      return 2;
    case Element::kUInt32:
    case Element::kFloat32:
      return 4;
    case Element::kUInt64:
    case Element::kFloat64:
      return 8;
  }
  return 0;
}

std::string Series::column_name(std::size_t column) const {
  if (columns == 1) return name;
  const std::string_view unit_text = unit_in_name(name);
  if (unit_text.empty()) return fmt::format("{}_{}", name, column + 1);
  const auto cut = name.rfind('_');
  return fmt::format("{}_{}{}", name.substr(0, cut), column + 1, name.substr(cut));
}

std::string_view unit_in_name(std::string_view name) {
  for (const NameUnit& own : kUnits)
    if (name.ends_with(own.ending)) return own.unit;
  const std::string_view unit = unit_in_ending(name);
  for (const NameUnit& other : kInAscii)
    if (unit == other.ending) return other.unit;
  return unit.empty() && name.ends_with("_s") ? "s" : unit;
}

std::string plain_name(std::string_view name) {
  std::string plain(name.substr(0, kLongestName));
  for (char& c : plain) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0 || (static_cast<unsigned char>(c) & 0x80u) != 0)
      c = '_';
  }
  if (plain.empty() || std::isalpha(static_cast<unsigned char>(plain.front())) == 0)
    plain = ("x_" + plain).substr(0, kLongestName);
  return plain;
}

Table dictionary(const Contents& contents) {
  std::vector<Entry> entries;
  for (const Table& table : contents.tables) {
    for (const Column& column : table.columns)
      entries.push_back({table.name, column.name, column.unit, column.meaning});
  }
  for (const ArrayGroup& group : contents.groups) {
    for (const Array& array : group.arrays)
      entries.push_back({group.name, array.name, array.unit, array.meaning});
  }
  std::set<std::string> seen;
  for (const Recording& recording : contents.recordings) {
    for (const Series& series : recording.series) {
      if (seen.insert(series.name).second)
        entries.push_back({"raw", series.name, series.unit, series.meaning});
    }
  }
  return TableBuilder("columns", "Unit and meaning of every column, array and time series", entries)
      .column("table", "", "Table, group of arrays, or raw", &Entry::table)
      .column("column", "", "Its column, array or time series", &Entry::column)
      .column("unit", "", "1: a plain number; empty: text, or not known", &Entry::unit)
      .column("meaning", "", "What it says", &Entry::meaning)
      .take();
}

}  // namespace tunnelrig::exports
