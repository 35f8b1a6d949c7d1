// What an export holds, said once for all formats: tables with units, arrays, documents, and the time series
// of each recording. Every writer (writer.h) writes all of it and nothing else, so that they cannot drift
// apart.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace tunnelrig::exports {

using Numbers = std::vector<double>;  // NaN: not known
using Integers = std::vector<std::int64_t>;
using Flags = std::vector<std::uint8_t>;  // 0 or 1
using Texts = std::vector<std::string>;   // UTF-8; empty: not known
using Values = std::variant<Numbers, Integers, Flags, Texts>;

/// One column of a table. Names are letters, digits and underscores, begin with a letter, and are at most 63
/// characters long, so that every format takes them; those of quantities end in their unit.
struct Column {
  std::string name;
  std::string unit;  // "N", "V", "rpm", "degC", …; "1" for a plain number; empty for text and for what
                     // a campaign of others does not tell
  std::string meaning;
  Values values;  // as many as the table has rows
};

struct Table {
  std::string name;
  std::string meaning;
  std::vector<Column> columns;

  std::size_t rows() const;
};

/// Numbers on a grid, row by row; an axis is a list.
struct Array {
  std::string name;
  std::string unit;
  std::string meaning;
  std::vector<std::size_t> shape;  // rows and columns, or the length
  std::vector<double> values;

  std::size_t columns() const { return shape.size() > 1 ? shape[1] : 1; }
};

/// Arrays that belong together: the maps with their axes, the covariances.
struct ArrayGroup {
  std::string name;
  std::string meaning;
  std::vector<Array> arrays;
};

/// A document as it is stored in the campaign file, byte by byte.
struct Attachment {
  std::string name;       // "calibration_3"
  std::string extension;  // "json", "toml"
  std::string text;
};

enum class Element { kInt16, kUInt16, kUInt32, kUInt64, kFloat32, kFloat64 };
std::size_t size_of(Element element);

/// One time series of a recording: frames × columns, little-endian.
struct Series {
  std::string name;  // "counts", "frame", "thrust_N"
  std::string unit;
  std::string meaning;
  Element element = Element::kInt16;
  std::size_t columns = 1;

  std::size_t frame_size() const { return size_of(element) * columns; }

  /// The name of one column, from 0: "frame", "counts_1", "thrust_1_N".
  std::string column_name(std::size_t column) const;
};

/// A recording whose series are exported. All of them have one row per frame that is stored; lost frames are
/// steps in `frame`, so that time since the start is frame / sample_rate_hz.
struct Recording {
  std::string key;       // its name in the export, as names of columns are
  std::string run;       // its name in the campaign
  std::string location;  // empty where the campaign lists no such run
  double sample_rate_hz = 0;
  std::uint64_t frames = 0;
  std::vector<Series> series;
};

/// Something that the campaign does not give (yet), and why.
struct Absent {
  std::string part, reason;
};

struct Contents {
  std::vector<std::pair<std::string, std::string>> provenance;  // key, text
  std::vector<Table> tables;
  std::vector<ArrayGroup> groups;
  std::vector<Attachment> texts;
  std::vector<Recording> recordings;
  std::vector<Absent> absent;
};

/// The unit that a name carries ("force_N": N); empty where it carries none.
std::string_view unit_in_name(std::string_view name);

/// `name` as every format takes it: other characters become underscores.
std::string plain_name(std::string_view name);

/// The table "columns": unit and meaning of every column, array and series above.
Table dictionary(const Contents& contents);

}  // namespace tunnelrig::exports
