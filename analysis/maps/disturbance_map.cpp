#include "analysis/maps/disturbance_map.h"

#include "analysis/maps/measured_region.h"
#include "datasets/csv.h"
#include "datasets/error.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include <nlohmann/json.hpp>

namespace tunnelrig {
namespace {

using json = nlohmann::ordered_json;  // keeps the order of keys, the provenance's too

constexpr const char* kFormat = "tunnelrig-map/1";
constexpr std::uint64_t kMostLocations = 1'000'000;
constexpr double kSameNode = 1e-9;            // of coordinates that another program's rounding moved
constexpr double kRoundingOfSymmetry = 0.05;  // percentage points, of values that were rounded

/// A value of the document that knows where it stands, so that every message can name its key.
class Node {
 public:
  Node(const json& value, const std::string& file, std::string key)
      : value_(value), file_(file), key_(std::move(key)) {}

  Node operator[](const std::string& name) const {
    if (!value_.is_object()) fail("must be an object");
    const std::string key = key_.empty() ? name : key_ + "." + name;
    const auto found = value_.find(name);
    if (found == value_.end()) throw InputError::in(file_, "the key {} is missing", key);
    return {*found, file_, key};
  }

  bool has(const std::string& name) const { return value_.is_object() && value_.contains(name); }

  template <typename... Args>
  [[noreturn]] void fail(fmt::format_string<Args...> rule, Args&&... args) const {
    throw InputError::in(file_, "the key {} {}", key_.empty() ? "(document)" : key_,
                         fmt::format(rule, std::forward<Args>(args)...));
  }

  double number() const {
    if (!value_.is_number()) fail("must be a number");
    return value_.get<double>();  // JSON has no other than finite ones
  }

  /// NaN for null: not known.
  double number_or_unknown() const {
    return value_.is_null() ? std::numeric_limits<double>::quiet_NaN() : number();
  }

  double positive() const {
    const double value = number();
    if (!(value > 0)) fail("must be above 0, is {}", value);
    return value;
  }

  int count() const {
    if (!value_.is_number_unsigned() || value_.get<std::uint64_t>() > kMostLocations) {
      fail("must be a whole number from 0 to {}", kMostLocations);
    }
    return value_.get<int>();
  }

  std::string text() const {
    if (!value_.is_string()) fail("must be a string");
    return value_.get<std::string>();
  }

  std::vector<Node> items() const {
    if (!value_.is_array()) fail("must be an array");
    std::vector<Node> items;
    items.reserve(value_.size());
    for (std::size_t i = 0; i < value_.size(); ++i) {
      items.emplace_back(value_[i], file_, fmt::format("{}[{}]", key_, i));
    }
    return items;
  }

  const json& object() const {
    if (!value_.is_object()) fail("must be an object");
    return value_;
  }

 private:
  const json& value_;
  const std::string& file_;
  std::string key_;
};

MapGeometry parse_geometry(const Node& node) {
  const MapGeometry geometry{.vehicle_width_m = node["vehicle_width_m"].positive(),
                             .vehicle_height_m = node["vehicle_height_m"].positive(),
                             .tunnel_width_m = node["tunnel_width_m"].positive(),
                             .tunnel_height_m = node["tunnel_height_m"].positive(),
                             .propeller_radius_m = node["propeller_radius_m"].positive()};
  if (geometry.vehicle_width_m >= geometry.tunnel_width_m) {
    node["vehicle_width_m"].fail("({} m) must be below tunnel_width_m ({} m)", geometry.vehicle_width_m,
                                 geometry.tunnel_width_m);
  }
  if (geometry.vehicle_height_m >= geometry.tunnel_height_m) {
    node["vehicle_height_m"].fail("({} m) must be below tunnel_height_m ({} m)", geometry.vehicle_height_m,
                                  geometry.tunnel_height_m);
  }
  return geometry;
}

std::vector<double> parse_axis(const Node& node) {
  std::vector<double> axis;
  for (const Node& item : node.items()) {
    axis.push_back(item.number());
    if (axis.size() > 1 && !(axis.back() > axis[axis.size() - 2]))
      item.fail("must be above the one before it");
  }
  if (axis.empty() || axis.front() != -1 || axis.back() != 1) node.fail("must run from -1 to 1");
  if (!std::binary_search(axis.begin(), axis.end(), 0.0)) node.fail("must hold a 0, where OT is");
  return axis;
}

std::vector<double> parse_matrix(const Node& node, const MapGrid& grid, double (Node::*read)() const) {
  const std::vector<Node> rows = node.items();
  if (rows.size() != grid.z_norm.size()) {
    node.fail("has {} rows where z_norm has {} values", rows.size(), grid.z_norm.size());
  }
  std::vector<double> values;
  values.reserve(grid.nodes());
  for (const Node& row : rows) {
    const std::vector<Node> cells = row.items();
    if (cells.size() != grid.y_norm.size()) {
      row.fail("has {} values where y_norm has {}", cells.size(), grid.y_norm.size());
    }
    for (const Node& cell : cells) values.push_back((cell.*read)());
  }
  return values;
}

MapLayer parse_layer(const Node& document, const std::string& name, const MapGrid& grid) {
  const Node u95 = document[name + "_u95_percent"];
  MapLayer layer{parse_matrix(document[name + "_percent"], grid, &Node::number),
                 parse_matrix(u95, grid, &Node::number_or_unknown)};
  if (std::any_of(layer.u95_percent.begin(), layer.u95_percent.end(), [](double u) { return u < 0; })) {
    u95.fail("must not hold a negative value");
  }
  return layer;
}

void check_origin(const Node& document, const MapGrid& grid, const MapLayer& delta_ct) {
  const auto zero_of = [](const std::vector<double>& axis) {
    return static_cast<std::size_t>(std::lower_bound(axis.begin(), axis.end(), 0.0) - axis.begin());
  };
  const double value = delta_ct.value_percent[grid.index(zero_of(grid.z_norm), zero_of(grid.y_norm))];
  if (value != 0) document["delta_ct_percent"].fail("must be 0 at y_norm = z_norm = 0, is {}", value);
}

/// A rotor does not pull down: C_T is not negative, nor is either pair's share of the sum. Nor does a wall
/// make it ten times stronger.
void check_thrusts(const Node& document, const DisturbanceMap& map) {
  constexpr double kMost_percent = 1000;
  for (const double value : map.delta_ct.value_percent) {
    if (value < -100) document["delta_ct_percent"].fail("must not be below -100 %, holds {}", value);
    if (value > kMost_percent)
      document["delta_ct_percent"].fail("must not be above {} %, holds {}", kMost_percent, value);
  }
  for (const auto& [key, layer] :
       {std::pair("delta_ct_u95_percent", &map.delta_ct), {"uneven_thrust_u95_percent", &map.uneven_thrust}})
    for (const double value : layer->u95_percent)
      if (value > kMost_percent) document[key].fail("must not be above {} %, holds {}", kMost_percent, value);
  for (const double value : map.uneven_thrust.value_percent) {
    if (std::abs(value) > 100)
      document["uneven_thrust_percent"].fail("must be from -100 to 100 %, holds {}", value);
  }
}

/// Flight takes the right half and mirrors it; a left half that says something else would be passed over.
void check_symmetry(const Node& layer, const std::vector<double>& values, const MapGrid& grid, double sign) {
  const std::vector<double>& y = grid.y_norm;
  for (std::size_t column = 0; column < y.size() && y[column] < kSameNode; ++column) {
    const auto image =
        static_cast<std::size_t>(std::lower_bound(y.begin(), y.end(), -y[column] - kSameNode) - y.begin());
    if (image == y.size() || y[image] > -y[column] + kSameNode) continue;
    for (std::size_t row = 0; row < grid.z_norm.size(); ++row) {
      const double here = values[grid.index(row, column)], there = values[grid.index(row, image)];
      if (std::abs(here - sign * there) <= kRoundingOfSymmetry) continue;
      layer.items()[row].items()[column].fail("must be {} in y_norm, is {} at {} and {} at {}",
                                              sign < 0 ? "odd" : "even", here, y[column], there, y[image]);
    }
  }
}

double parse_coordinate(const Node& node) {
  const double value = node.number();
  if (std::abs(value) > 1) node.fail("must be within -1 and 1, is {}", value);
  return value;
}

double parse_u95(const Node& node) {
  const double value = node.number_or_unknown();
  if (value < 0) node.fail("must not be negative, is {}", value);
  return value;
}

MeasuredLocation parse_location(const Node& node) {
  return {.label = node["label"].text(),
          .y_norm = parse_coordinate(node["y_norm"]),
          .z_norm = parse_coordinate(node["z_norm"]),
          .delta_ct_percent = node["delta_ct_percent"].number(),
          .delta_ct_u95_percent = parse_u95(node["delta_ct_u95_percent"]),
          .uneven_thrust_percent = node["uneven_thrust_percent"].number(),
          .uneven_thrust_u95_percent = parse_u95(node["uneven_thrust_u95_percent"])};
}

FitSummary parse_fit(const Node& node) {
  FitSummary fit;
  const Node hyperparameters = node["hyperparameters"];
  for (const auto& [name, value] : hyperparameters.object().items()) {
    fit.hyperparameters[name] = hyperparameters[name].number();
  }
  const Node loo = node["leave_one_out"];
  fit.leave_one_out = {.locations = loo["locations"].count(),
                       .rms_percent = loo["rms_percent"].number(),
                       .standardised_rms = {}};
  if (loo.has("standardised_rms")) fit.leave_one_out.standardised_rms = loo["standardised_rms"].number();
  if (node.has("offset_percent")) {
    fit.offset = RigOffset{node["offset_percent"].number(), parse_u95(node["offset_u95_percent"])};
  }
  return fit;
}

json matrix_json(const std::vector<double>& values, const MapGrid& grid) {
  json rows = json::array();
  for (std::size_t row = 0; row < grid.z_norm.size(); ++row) {
    const auto begin = values.begin() + static_cast<std::ptrdiff_t>(grid.index(row, 0));
    rows.push_back(std::vector<double>(begin, begin + static_cast<std::ptrdiff_t>(grid.y_norm.size())));
  }
  return rows;
}

json fit_json(const FitSummary& fit) {
  json loo = {{"locations", fit.leave_one_out.locations}, {"rms_percent", fit.leave_one_out.rms_percent}};
  if (fit.leave_one_out.standardised_rms) loo["standardised_rms"] = *fit.leave_one_out.standardised_rms;
  json fields{{"hyperparameters", fit.hyperparameters}, {"leave_one_out", loo}};
  if (fit.offset) {
    fields["offset_percent"] = fit.offset->value_percent;
    fields["offset_u95_percent"] = fit.offset->u95_percent;
  }
  return fields;
}

json location_json(const MeasuredLocation& location) {
  return {{"label", location.label},
          {"y_norm", location.y_norm},
          {"z_norm", location.z_norm},
          {"delta_ct_percent", location.delta_ct_percent},
          {"delta_ct_u95_percent", location.delta_ct_u95_percent},
          {"uneven_thrust_percent", location.uneven_thrust_percent},
          {"uneven_thrust_u95_percent", location.uneven_thrust_u95_percent}};
}

json region_json(const DisturbanceMap& map) {
  const MeasuredRegion region = measured_region(map);
  json corners = json::array();
  for (const auto& [y_norm, z_norm] : region.corners())
    corners.push_back({y_norm + 0.0, z_norm + 0.0});  // without −0
  return corners;
}

json to_json(const DisturbanceMap& map) {
  json reference = {{"c_t_origin", map.c_t_origin}};
  if (map.c_t_open_space) reference["c_t_open_space"] = *map.c_t_open_space;
  json locations = json::array();
  for (const MeasuredLocation& location : map.locations) locations.push_back(location_json(location));
  return {{"format", kFormat},
          {"geometry",
           {{"vehicle_width_m", map.geometry.vehicle_width_m},
            {"vehicle_height_m", map.geometry.vehicle_height_m},
            {"tunnel_width_m", map.geometry.tunnel_width_m},
            {"tunnel_height_m", map.geometry.tunnel_height_m},
            {"propeller_radius_m", map.geometry.propeller_radius_m}}},
          {"reference", reference},
          {"method", map.method},
          {"coverage_factor", map.coverage_factor},
          {"fits",
           {{"delta_ct", fit_json(map.delta_ct_fit)}, {"uneven_thrust", fit_json(map.uneven_thrust_fit)}}},
          {"provenance", json::parse(map.provenance)},
          {"locations", locations},
          {"measured_region", region_json(map)},
          {"y_norm", map.grid.y_norm},
          {"z_norm", map.grid.z_norm},
          {"delta_ct_percent", matrix_json(map.delta_ct.value_percent, map.grid)},
          {"delta_ct_u95_percent", matrix_json(map.delta_ct.u95_percent, map.grid)},
          {"uneven_thrust_percent", matrix_json(map.uneven_thrust.value_percent, map.grid)},
          {"uneven_thrust_u95_percent", matrix_json(map.uneven_thrust.u95_percent, map.grid)}};
}

}  // namespace

bool MapLayer::u95_known() const {
  return std::ranges::none_of(u95_percent, [](double u95) { return std::isnan(u95); });
}

bool RigOffset::significant() const { return std::abs(value_percent) > u95_percent; }

std::string format_disturbance_map(const DisturbanceMap& map) {
  // One key a line, and one line for each element of an array of arrays or objects: readable, and diffs stay
  // small.
  const json document = to_json(map);
  std::string out = "{";
  const char* before_key = "\n";
  for (const auto& [key, value] : document.items()) {
    out += fmt::format("{}{}: ", before_key, json(key).dump());
    before_key = ",\n";
    if (!value.is_array() || value.empty() || !value[0].is_structured()) {
      out += value.dump();
      continue;
    }
    const char* before_item = "[\n ";
    for (const json& item : value) {
      out += before_item + item.dump();
      before_item = ",\n ";
    }
    out += "]";
  }
  return out + "\n}\n";
}

DisturbanceMap parse_disturbance_map(std::string_view text, const std::string& file) {
  json parsed;
  try {
    parsed = json::parse(text);
  } catch (const json::exception& error) {
    throw InputError::in(file, "is not a disturbance map: {}", error.what());
  }
  const Node document(parsed, file, "");
  const std::string format = document["format"].text();
  if (format != kFormat) document["format"].fail("is '{}' where this program reads '{}'", format, kFormat);

  DisturbanceMap map;
  map.geometry = parse_geometry(document["geometry"]);
  map.grid = {parse_axis(document["y_norm"]), parse_axis(document["z_norm"])};
  map.delta_ct = parse_layer(document, "delta_ct", map.grid);
  map.uneven_thrust = parse_layer(document, "uneven_thrust", map.grid);
  check_origin(document, map.grid, map.delta_ct);
  check_thrusts(document, map);
  check_symmetry(document["delta_ct_percent"], map.delta_ct.value_percent, map.grid, 1);
  check_symmetry(document["uneven_thrust_percent"], map.uneven_thrust.value_percent, map.grid, -1);
  for (const Node& location : document["locations"].items())
    map.locations.push_back(parse_location(location));
  map.method = document["method"].text();
  map.coverage_factor = document["coverage_factor"].positive();
  const Node reference = document["reference"];
  map.c_t_origin = reference["c_t_origin"].positive();
  if (reference.has("c_t_open_space")) map.c_t_open_space = reference["c_t_open_space"].positive();
  map.delta_ct_fit = parse_fit(document["fits"]["delta_ct"]);
  map.uneven_thrust_fit = parse_fit(document["fits"]["uneven_thrust"]);
  map.provenance = document["provenance"].object().dump();
  return map;
}

DisturbanceMap read_disturbance_map(const std::filesystem::path& path) {
  return parse_disturbance_map(read_text(path), path.string());
}

}  // namespace tunnelrig
