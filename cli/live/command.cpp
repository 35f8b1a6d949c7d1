#include "cli/live/command.h"

#include "daq/run_plan.h"
#include "datasets/campaign.h"
#include "datasets/error.h"

#include <algorithm>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace tunnelrig::live {
namespace {

using Object = nlohmann::json;

constexpr std::size_t kLongestLabel = 64;
constexpr std::size_t kLongestText = 2000;

/// The keys that a command takes beside "command" and "token".
const std::map<std::string, std::vector<std::string>>& commands() {
  static const std::map<std::string, std::vector<std::string>> table = {
      {"start", {"location", "session", "repeat", "kind", "duration_s"}},
      {"stop", {"run"}},
      {"tare", {"location", "session", "duration_s"}},
      {"next", {}},
      {"note", {"run", "text"}},
      {"redo", {"run"}},
      {"exclude", {"run", "reason"}},
      {"include", {"run"}},
      {"metadata", {"values"}},
      {"target", {"c_t_u95", "u_percent_u95"}}};
  return table;
}

class Reader {
 public:
  explicit Reader(const Object& object) : object_(object) {}

  std::string text(const char* key, std::size_t longest) const {
    const Object* value = find(key);
    if (value == nullptr) return "";
    if (!value->is_string()) throw InputError(fmt::format("{}: a text is expected", key));
    const auto& text = value->get_ref<const std::string&>();
    if (text.size() > longest) throw InputError(fmt::format("{}: at most {} characters", key, longest));
    return text;
  }

  /// What becomes a cell that others are matched with.
  std::string label(const char* key) const {
    std::string label = text(key, kLongestLabel);
    const bool odd = std::any_of(label.begin(), label.end(),
                                 [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7F; });
    if (odd || label.starts_with(' ') || label.ends_with(' '))
      throw InputError(fmt::format("{}: no control characters, no blanks at either end", key));
    return label;
  }

  std::optional<double> number(const char* key, double low, double high) const {
    const Object* value = find(key);
    if (value == nullptr) return {};
    return in_range(key, *value, low, high);
  }

  static double in_range(const std::string& key, const Object& value, double low, double high) {
    if (!value.is_number()) throw InputError(fmt::format("{}: a number is expected", key));
    const auto number = value.get<double>();
    if (!(number >= low && number <= high))
      throw InputError(fmt::format("{}: {:g} is outside {:g} to {:g}", key, number, low, high));
    return number;
  }

 private:
  const Object* find(const char* key) const {
    const auto found = object_.find(key);
    return found == object_.end() || found->is_null() ? nullptr : &*found;
  }

  const Object& object_;
};

std::map<std::string, std::optional<double>> metadata_values(const Object& object) {
  const auto found = object.find("values");
  if (found == object.end() || !found->is_object())
    throw InputError("metadata: values is an object of numbers");
  std::map<std::string, std::optional<double>> values;
  for (const auto& item : found->items()) {
    const std::string& name = item.key();
    const Object& value = item.value();
    const auto* field =
        std::find_if(kMetadata.begin(), kMetadata.end(), [&](const auto& f) { return name == f.name; });
    if (field == kMetadata.end()) throw InputError("metadata: there is no quantity of this name");
    values[name] = std::nullopt;
    if (value.is_null()) continue;
    const auto [low, high] = range_of(name).value();
    values[name] = Reader::in_range(fmt::format("{} [{}]", field->label, field->unit), value, low, high);
  }
  return values;
}

}  // namespace

Command parse_command(std::string_view body) {
  const Object object = Object::parse(body, nullptr, false);
  if (!object.is_object()) throw InputError("a command is a JSON object");
  const Reader read(object);
  Command command{.name = read.text("command", kLongestLabel), .token = read.text("token", kLongestLabel)};
  const auto known = commands().find(command.name);
  if (known == commands().end()) throw InputError("there is no such command");
  for (const auto& [key, value] : object.items()) {
    const auto& keys = known->second;
    if (key != "command" && key != "token" && std::find(keys.begin(), keys.end(), key) == keys.end())
      throw InputError(fmt::format("{} has no such key; it takes: {}", command.name, fmt::join(keys, ", ")));
  }
  command.location = read.label("location");
  command.session = read.label("session");
  command.run = read.label("run");
  command.text = read.text("text", kLongestText);
  command.reason = read.text("reason", kLongestText);
  if (const std::string kind = read.text("kind", kLongestLabel); !kind.empty()) {
    if (kind != "thrust" && kind != "tare") throw InputError("kind: thrust or tare");
    command.kind = kind == "tare" ? RunKind::kTare : RunKind::kThrust;
  }
  if (const auto repeat = read.number("repeat", 0, 1e6)) command.repeat = static_cast<int>(*repeat);
  command.duration_s = read.number("duration_s", 0.1, kLongestRun_s);
  command.c_t_u95 = read.number("c_t_u95", 1e-9, 10);
  command.u_percent_u95 = read.number("u_percent_u95", 1e-9, 1000);
  if (command.name == "metadata") command.values = metadata_values(object);
  return command;
}

}  // namespace tunnelrig::live
