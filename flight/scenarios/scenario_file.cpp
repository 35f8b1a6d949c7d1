#include "datasets/error.h"
#include "datasets/toml_keys.h"
#include "flight/scenarios/scenario.h"

#include <cmath>
#include <optional>

#define TOML_EXCEPTIONS 1
#include <toml++/toml.h>

namespace tunnelrig {
namespace {

/// One table of the file, whose messages name file, line and key.
class Fields {
 public:
  Fields(const toml::table& table, const std::string& file) : table_(table), file_(file) {}

  void require_only(const std::string& owner, std::initializer_list<std::string_view> known) const {
    require_known_keys(table_, owner, file_, known);
  }

  int line() const { return static_cast<int>(table_.source().begin.line); }

  std::optional<double> number(std::string_view key, double lowest, double highest) const {
    const toml::node* node = table_.get(key);
    if (node == nullptr) return {};
    return checked(*node, key, lowest, highest);
  }

  double required(std::string_view key, double lowest, double highest) const {
    if (const auto value = number(key, lowest, highest)) return *value;
    throw InputError::at(file_, line(), "{} is missing", key);
  }

  Plane pair(std::string_view key, double lowest, double highest) const {
    const toml::node* node = table_.get(key);
    if (node == nullptr) throw InputError::at(file_, line(), "{} is missing; write {} = [y, z]", key, key);
    const toml::array* array = node->as_array();
    if (array == nullptr || array->size() != 2)
      throw InputError::at(file_, static_cast<int>(node->source().begin.line),
                           "{} must be two numbers, [y, z]", key);
    return {checked(*array->get(0), key, lowest, highest), checked(*array->get(1), key, lowest, highest)};
  }

  std::string text(std::string_view key) const {
    const toml::node* node = table_.get(key);
    if (node == nullptr) return {};
    const auto value = node->value<std::string>();
    if (!value || !node->is_string())
      throw InputError::at(file_, static_cast<int>(node->source().begin.line), "{} must be a text", key);
    return *value;
  }

 private:
  double checked(const toml::node& node, std::string_view key, double lowest, double highest) const {
    const auto value = node.value<double>();
    if (!value || !(*value >= lowest && *value <= highest))
      throw InputError::at(file_, static_cast<int>(node.source().begin.line),
                           "{} must be a number from {:g} to {:g}", key, lowest, highest);
    return *value;
  }

  const toml::table& table_;
  const std::string& file_;
};

constexpr double kFar_m = 100, kLongest_s = 3600;

/// A piece must begin where the one before ended: a reference that jumps is a mistake of the file.
void check_joint(const Trajectory& before, const Trajectory& after, const std::string& file, int line) {
  if (before.segments().empty()) return;
  const Plane end = before.at(before.duration_s() + 1).position_m;
  const Plane begin = after.segments().back().at(0).position_m;
  if (std::hypot(end[0] - begin[0], end[1] - begin[1]) > 1e-3)
    throw InputError::at(file, line,
                         "this segment begins at ({:g}, {:g}), but the one before ends at ({:g}, {:g})",
                         begin[0], begin[1], end[0], end[1]);
}

void add_segment(Trajectory& trajectory, const Plane& start, const Fields& f, const std::string& file) {
  const Plane here =
      trajectory.segments().empty() ? start : trajectory.at(trajectory.duration_s() + 1).position_m;
  const Trajectory before = trajectory;
  const std::string kind = f.text("kind");
  const auto keys = [&](std::initializer_list<std::string_view> known) { f.require_only(kind, known); };
  if (kind == "hold") {
    keys({"kind", "duration_s"});
    trajectory.hold(here, f.required("duration_s", 0.01, kLongest_s));
  } else if (kind == "move") {
    keys({"kind", "to", "acceleration_m_s2", "speed_m_s"});
    if (trajectory.segments().empty()) trajectory.hold(here, 0);
    trajectory.move(f.pair("to", -kFar_m, kFar_m), f.required("acceleration_m_s2", 0.001, 10),
                    f.number("speed_m_s", 0.001, 20).value_or(0));
  } else if (kind == "circle") {
    keys({"kind", "centre", "radius_m", "rate_rad_s", "turns"});
    trajectory.circle(f.pair("centre", -kFar_m, kFar_m), f.required("radius_m", 0.001, kFar_m),
                      f.required("rate_rad_s", -20, 20), f.required("turns", 0.01, 1000));
  } else if (kind == "figure") {
    keys({"kind", "centre", "amplitude", "rates_rad_s", "duration_s"});
    trajectory.figure(f.pair("centre", -kFar_m, kFar_m), f.pair("amplitude", -kFar_m, kFar_m),
                      f.pair("rates_rad_s", -20, 20), f.required("duration_s", 0.01, kLongest_s));
  } else {
    throw InputError::at(file, f.line(), "kind must be hold, move, circle or figure, is '{}'", kind);
  }
  const double duration = trajectory.duration_s();
  if (!(duration <= kLongest_s))
    throw InputError::at(file, f.line(), "the scenario lasts longer than an hour");
  check_joint(before, trajectory, file, f.line());
}

}  // namespace

Scenario parse_scenario(std::string_view text, const std::string& file) {
  toml::table document;
  try {
    document = toml::parse(text, file);
  } catch (const toml::parse_error& error) {
    throw InputError::at(file, static_cast<int>(error.source().begin.line), "{}", error.description());
  }
  const Fields fields(document, file);
  if (fields.text("format") != "tunnelrig-scenario/1")
    throw InputError::in(file, "must say format = \"tunnelrig-scenario/1\"");
  fields.require_only("the file", {"format", "name", "start", "tunnel", "score_from_s", "segments"});
  Scenario scenario{.name = fields.text("name"), .tunnel = fields.text("tunnel")};
  if (scenario.name.empty()) scenario.name = file;
  const toml::array* segments = document["segments"].as_array();
  if (segments == nullptr || segments->empty()) throw InputError::in(file, "has no [[segments]]");
  constexpr std::size_t kMostSegments = 1000;
  if (segments->size() > kMostSegments)
    throw InputError::in(file, "has more than {} segments", kMostSegments);
  Plane start{};
  const toml::table* first = segments->get(0)->as_table();
  const bool stands = first != nullptr && ((*first)["kind"].value_or(std::string()) == "hold" ||
                                           (*first)["kind"].value_or(std::string()) == "move");
  if (stands) start = fields.pair("start", -kFar_m, kFar_m);
  for (const toml::node& node : *segments) {
    const toml::table* table = node.as_table();
    if (table == nullptr)
      throw InputError::at(file, static_cast<int>(node.source().begin.line),
                           "segments must be tables, [[segments]]");
    add_segment(scenario.trajectory, start, Fields(*table, file), file);
  }
  scenario.score_from_s = fields.number("score_from_s", 0, kLongest_s).value_or(0);
  if (scenario.score_from_s >= scenario.trajectory.duration_s())
    throw InputError::in(file, "score_from_s = {:g} is after the end at {:g} s", scenario.score_from_s,
                         scenario.trajectory.duration_s());
  return scenario;
}

}  // namespace tunnelrig
