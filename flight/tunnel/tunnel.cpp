#include "flight/tunnel/tunnel.h"

#include "datasets/csv.h"
#include "datasets/error.h"
#include "flight/tunnel/shapes.h"

#include <cmath>
#include <initializer_list>
#include <string_view>

#include <toml++/toml.h>

namespace tunnelrig {
namespace {

// Chapter 6: height 16.7 h_q and width 6.3 w_q, with h_q = 0.3 m and w_q = 0.715 m. Its length is not stated.
constexpr double kRailway_width_m = 4.5;
constexpr double kRailway_height_m = 5.0;
constexpr double kRailway_length_m = 100;

constexpr double kLongest_m = 1000;

int line_of(const toml::node& node) { return static_cast<int>(node.source().begin.line); }

toml::table parse_document(const std::string& text, const std::string& file) {
  try {
    return toml::parse(text, file);
  } catch (const toml::parse_error& error) {
    throw InputError::at(file, static_cast<int>(error.source().begin.line), "{}", error.description());
  }
}

void check_keys(const toml::table& table, std::initializer_list<std::string_view> known,
                const std::string& file) {
  for (const auto& [key, node] : table) {
    bool found = false;
    for (const std::string_view name : known) found = found || key.str() == name;
    if (!found) throw InputError::at(file, line_of(node), "{} is not a key of this table", key.str());
  }
}

double number(const toml::node& node, std::string_view what, const std::string& file, double lowest,
              double highest) {
  const auto value = node.value<double>();
  if (!node.is_number() || !value || !(*value >= lowest && *value <= highest))
    throw InputError::at(file, line_of(node), "{} must be a number from {} to {}", what, lowest, highest);
  return *value;
}

const toml::node& require(const toml::table& table, std::string_view key, const std::string& file) {
  const toml::node* node = table.get(key);
  if (node == nullptr) throw InputError::at(file, line_of(table), "{} is missing", key);
  return *node;
}

double length(const toml::table& table, std::string_view key, const std::string& file) {
  return number(require(table, key, file), key, file, 0.01, kLongest_m);
}

std::vector<SectionPoint> vertices(const toml::table& document, const std::string& file) {
  const toml::node& node = require(document, "vertices_m", file);
  const toml::array* list = node.as_array();
  if (list == nullptr || list->size() < 3)
    throw InputError::at(file, line_of(node), "vertices_m must be a list of at least three [y, z]");
  std::vector<SectionPoint> result;
  for (const toml::node& item : *list) {
    const toml::array* pair = item.as_array();
    if (pair == nullptr || pair->size() != 2)
      throw InputError::at(file, line_of(item), "vertex {} must be [y, z]", result.size() + 1);
    result.emplace_back(number((*pair)[0], "y", file, -kLongest_m, kLongest_m),
                        number((*pair)[1], "z", file, -kLongest_m, kLongest_m));
  }
  return result;
}

int segments(const toml::table& document, const std::string& file, int usual) {
  const toml::node* node = document.get("segments");
  return node == nullptr ? usual : static_cast<int>(number(*node, "segments", file, 3, 500));
}

std::vector<SectionPoint> outline(const toml::table& document, const std::string& shape,
                                  const std::string& file) {
  if (shape == "square") {
    const double width = length(document, "width_m", file);
    return box_outline(width, width);
  }
  if (shape == "box")
    return box_outline(length(document, "width_m", file), length(document, "height_m", file));
  if (shape == "circle")
    return circle_outline(length(document, "diameter_m", file), segments(document, file, 72));
  if (shape == "arch") {
    const double height = length(document, "height_m", file);
    const double wall = length(document, "wall_height_m", file);
    if (!(wall < height))
      throw InputError::at(file, line_of(require(document, "wall_height_m", file)),
                           "wall_height_m must be less than height_m");
    return arch_outline(length(document, "width_m", file), height, wall, segments(document, file, 24));
  }
  if (shape == "polygon") return centred(vertices(document, file));
  throw InputError::at(file, line_of(require(document, "shape", file)),
                       "shape \"{}\": known are square, box, arch, circle, polygon", shape);
}

std::vector<SectionFeature> features(const toml::table& document, const std::string& file) {
  std::vector<SectionFeature> result;
  const toml::node* node = document.get("feature");
  if (node == nullptr) return result;
  const toml::array* list = node->as_array();
  if (list == nullptr) throw InputError::at(file, line_of(*node), "features are written as [[feature]]");
  for (const toml::node& item : *list) {
    const toml::table* table = item.as_table();
    if (table == nullptr) throw InputError::at(file, line_of(item), "features are written as [[feature]]");
    check_keys(*table, {"edge", "from_m", "to_m", "inward_m"}, file);
    const auto value = [&](std::string_view key, double lowest) {
      return number(require(*table, key, file), key, file, lowest, kLongest_m);
    };
    result.push_back({static_cast<std::size_t>(value("edge", 0)), value("from_m", 0), value("to_m", 0),
                      value("inward_m", -kLongest_m)});
  }
  return result;
}

std::string text(const toml::table& document, std::string_view key, const std::string& file) {
  const toml::node& node = require(document, key, file);
  if (!node.is_string()) throw InputError::at(file, line_of(node), "{} must be text in quotes", key);
  return node.value_or(std::string());
}

}  // namespace

FlightTunnel parse_tunnel(const std::string& toml, const std::string& file) {
  const toml::table document = parse_document(toml, file);
  check_keys(document,
             {"name", "shape", "length_m", "width_m", "height_m", "wall_height_m", "diameter_m", "segments",
              "vertices_m", "feature"},
             file);
  const std::string shape = text(document, "shape", file);
  const auto plain = outline(document, shape, file);
  const auto small = features(document, file);
  const auto section = with_features(plain, small, file);
  FlightTunnel tunnel{text(document, "name", file),
                      CrossSection(section, file),
                      length(document, "length_m", file),
                      shape == "circle" ? length(document, "diameter_m", file) : 0,
                      {}};
  if (!small.empty()) tunnel.plain_box = CrossSection(plain, file).box();
  return tunnel;
}

FlightTunnel read_tunnel(const std::filesystem::path& path) {
  return parse_tunnel(read_text(path), path.string());
}

FlightTunnel tunnel_from(const std::string& name_or_file) {
  if (name_or_file == "1.5") return {"1.5", CrossSection(box_outline(1.5, 1.5)), 2.5};
  if (name_or_file == "2.4") return {"2.4", CrossSection(box_outline(2.35, 2.39)), 6.06};
  if (name_or_file == "railway")
    return {"railway",
            CrossSection(
                arch_outline(kRailway_width_m, kRailway_height_m, kRailway_height_m - kRailway_width_m / 2)),
            kRailway_length_m};
  if (!std::filesystem::exists(name_or_file))
    throw InputError::in(name_or_file, "no such tunnel: 1.5, 2.4, railway, or a file");
  return read_tunnel(name_or_file);
}

}  // namespace tunnelrig
