#include "attribution/scorer/outcome.h"

#include "datasets/error.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace tunnelrig::attribution {
namespace {

using nlohmann::json;

/// Reads members and remembers which rule of the contract was broken.
class Reader {
 public:
  explicit Reader(std::vector<std::string>& broken) : broken_(broken) {}

  const json& member(const json& object, const std::string& name, const std::string& path) {
    static const json kNothing;
    if (object.is_object() && object.contains(name)) return object[name];
    broken_.push_back(path + name + " is missing");
    return kNothing;
  }

  double number(const json& object, const std::string& name, const std::string& path) {
    const json& value = member(object, name, path);
    if (value.is_number() && std::isfinite(value.get<double>())) return value.get<double>();
    if (object.is_object() && object.contains(name)) broken_.push_back(path + name + " is no finite number");
    return std::nan("");
  }

  std::string text(const json& object, const std::string& name, const std::string& path) {
    const json& value = member(object, name, path);
    if (value.is_string()) return value.get<std::string>();
    broken_.push_back(path + name + " is no text");
    return {};
  }

  const json& list(const json& object, const std::string& name, const std::string& path) {
    static const json kEmpty = json::array();
    const json& value = member(object, name, path);
    if (value.is_array()) return value;
    broken_.push_back(path + name + " is no list");
    return kEmpty;
  }

  std::array<double, 2> bounds(const json& object, const std::string& name, const std::string& path) {
    const json& value = list(object, name, path);
    if (value.size() == 2 && value[0].is_number() && value[1].is_number()) {
      return {value[0].get<double>(), value[1].get<double>()};
    }
    broken_.push_back(path + name + " is no pair of numbers");
    return {std::nan(""), std::nan("")};
  }

 private:
  std::vector<std::string>& broken_;
};

FoundEffect parse_found(const json& entry, Reader& reader) {
  const std::string path = "adopted[].";
  FoundEffect found{.name = reader.text(entry, "effect", path)};
  for (const json& other : reader.list(entry, "confounded_with", path)) {
    if (other.is_string()) found.confounded_with.push_back(other);
    // an entry that carries more than the name is read all the same
    if (other.is_object()) found.confounded_with.push_back(reader.text(other, "effect", path));
  }
  reader.number(entry, "p_value", path);
  reader.number(entry, "held_out_gain", path);
  reader.member(entry, "rotor", path);
  found.has_separating_run = !reader.member(entry, "separating_run", path).is_null();
  const json& parameters = reader.member(entry, "parameters", path);
  if (!parameters.is_object()) return found;
  for (const auto& [name, value] : parameters.items()) {
    const std::string where = fmt::format("{}parameters.{}.", path, name);
    const auto [low, high] = reader.bounds(value, "ci95", where);
    found.parameters.push_back(
        {name, reader.text(value, "unit", where), reader.number(value, "value", where), low, high});
  }
  return found;
}

}  // namespace

bool FoundEffect::set_contains(const std::string& effect) const {
  return name == effect ||
         std::find(confounded_with.begin(), confounded_with.end(), effect) != confounded_with.end();
}

Key parse_key(const json& document) {
  try {
    const json& design = document.at("design");
    Key key{.track = document.at("track"),
            .noise = design.at("noise"),
            .order = design.at("order"),
            .size = document.at("size"),
            .blocks = design.at("blocks"),
            .raw = design.at("raw"),
            .acceptable = document.at("acceptable"),
            .floor_N = document.at("noise_floor").at("with_coefficients_N"),
            .floor_root_N = document.at("noise_floor").at("root_N")};
    for (const json& entry : document.at("effects")) {
      TrueEffect effect{
          .name = entry.at("effect"), .level = entry.at("level"), .covariates = entry.at("covariates")};
      for (const json& one : entry.at("parameters")) {
        effect.parameters.push_back({one.at("name"), one.at("unit"), one.at("value")});
      }
      key.effects.push_back(effect);
    }
    return key;
  } catch (const json::exception& error) {
    throw InputError(fmt::format("not a key: {}", error.what()));
  }
}

Explanation parse_explanation(const json& document) {
  Explanation explanation;
  Reader reader(explanation.broken_rules);
  for (const char* name : {"format", "campaign", "response", "unit", "baseline"})
    reader.text(document, name, "");
  for (const char* name : {"blocks", "runs", "detectable_at_80_percent_power"})
    reader.number(document, name, "");
  for (const char* name : {"untestable", "suspect_rows"}) reader.list(document, name, "");
  explanation.verdict = reader.text(document, "verdict", "");
  explanation.noise_floor_N = reader.number(document, "noise_floor", "");
  for (const char* stage : {"before", "after"}) {
    const json& errors = reader.member(document, stage, "");
    const std::string path = std::string(stage) + ".";
    reader.number(errors, "rmse", path);
    explanation.held_out_N = reader.number(errors, "held_out_rmse", path);
    const auto [low, high] = reader.bounds(errors, "held_out_ci95", path);
    explanation.held_out_low_N = low;
    explanation.held_out_high_N = high;
  }
  for (const json& entry : reader.list(document, "adopted", "")) {
    explanation.adopted.push_back(parse_found(entry, reader));
  }
  for (const json& entry : reader.list(document, "unknown", "")) {
    explanation.unknown_covariates.push_back(reader.text(entry, "covariate", "unknown[]."));
  }
  return explanation;
}

Outcome parse_outcome(const std::string& line, const std::string& where) {
  const json document = json::parse(line, nullptr, false);
  if (!document.is_object() || !document.contains("key")) {
    throw InputError(
        fmt::format("{}: is no result of the benchmark (an object with key and explain)", where));
  }
  Outcome outcome;
  try {
    outcome.key = parse_key(document["key"]);
  } catch (const InputError& error) {
    throw InputError(fmt::format("{}: {}", where, error.what()));
  }
  const auto read = [&](const char* name) -> std::optional<Explanation> {
    if (!document.contains(name) || document[name].is_null()) return {};
    return parse_explanation(document[name]);
  };
  outcome.explanation = read("explain");
  outcome.separated = read("separated");
  if (document.contains("seconds") && document["seconds"].is_number()) outcome.seconds = document["seconds"];
  return outcome;
}

}  // namespace tunnelrig::attribution
