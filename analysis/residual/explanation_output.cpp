#include "analysis/residual/explanation_output.h"

#include <algorithm>
#include <cmath>
#include <map>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace tunnelrig {
namespace {

using Json = nlohmann::ordered_json;

Json finite(double value) { return std::isfinite(value) ? Json(value) : Json(0.0); }

Json rotor_json(int rotor) { return rotor < 0 ? Json(nullptr) : Json(rotor + 1); }

Json error_json(const ErrorEstimate& error) {
  return {{"rmse", finite(error.rmse)},
          {"held_out_rmse", finite(error.held_out_rmse)},
          {"held_out_ci95", {finite(error.held_out_low), finite(error.held_out_high)}}};
}

Json adopted_json(const AdoptedEffect& adopted) {
  Json parameters = Json::object();
  for (const ParameterEstimate& parameter : adopted.parameters) {
    parameters[parameter.name] = {{"value", finite(parameter.value)},
                                  {"ci95", {finite(parameter.low), finite(parameter.high)}},
                                  {"unit", parameter.unit},
                                  {"theory", parameter.theory}};
    if (!parameter.run.empty()) parameters[parameter.name]["run"] = parameter.run;
    for (const GroupEstimate& group : parameter.groups)
      parameters[parameter.name]["groups"].push_back({{"group", group.group},
                                                      {"value", finite(group.value)},
                                                      {"ci95", {finite(group.low), finite(group.high)}}});
  }
  Json separating = nullptr;
  if (const auto& run = adopted.separating_run) {
    separating = {{"setting", Json::object()},
                  {"location", run->location},
                  {"expected_sigma", finite(run->expected_sigma)},
                  {"text", run->text}};
    for (const auto& [name, value] : run->setting) separating["setting"][name] = value;
  }
  Json json{{"effect", adopted.term.effect->name},        {"form", adopted.term.effect->form},
            {"rotor", rotor_json(adopted.term.rotor)},    {"parameters", parameters},
            {"p_value", finite(adopted.p_value)},         {"held_out_gain", finite(adopted.held_out_gain)},
            {"confounded_with", adopted.confounded_with}, {"separating_run", separating}};
  if (adopted.term.other >= 0) json["from_rotor"] = adopted.term.other + 1;
  return json;
}

Json unknown_json(const UnknownStructure& unknown) {
  Json shape = Json::array();
  for (const ShapePoint& point : unknown.shape)
    shape.push_back({finite(point.x), finite(point.y), finite(point.low), finite(point.high)});
  return {{"covariate", unknown.covariate},
          {"covariate_unit", unknown.covariate_unit},
          {"place", unknown.place.empty() ? Json(nullptr) : Json(unknown.place)},
          {"times", unknown.times.empty() ? Json(nullptr) : Json(unknown.times)},
          {"rotor", rotor_json(unknown.rotor)},
          {"p_value", finite(unknown.p_value)},
          {"amplitude", finite(unknown.amplitude)},
          {"shape", shape},
          {"labels", unknown.labels},
          {"instead_of", unknown.instead_of}};
}

std::string name_of_value(const UnknownStructure& unknown, double x) {
  if (unknown.labels.empty()) return fmt::format("{:g}", x);
  const std::string& label = unknown.labels[static_cast<std::size_t>(x) - 1];
  return label.empty() ? "(empty)" : label;
}

/// What each text or, of few, each value makes: "A −0.012, B 0.012 N".
std::string levels_in_words(const UnknownStructure& unknown, const std::string& unit) {
  std::string text;
  for (const ShapePoint& point : unknown.shape)
    text += fmt::format("{}{} {:+.3g} ± {:.2g}", text.empty() ? "" : ", ", name_of_value(unknown, point.x),
                        point.y, (point.high - point.low) / 2);
  return text + unit;
}

std::string place_in_words(const std::string& place) {
  if (place == "tunnel") return "in the tunnel, compared with open space";
  return fmt::format("in proportion to {} of the location; drawn as it is at {} = 1", place, place);
}

std::string parameters_in_words(const AdoptedEffect& adopted) {
  std::string text;
  for (const ParameterEstimate& parameter : adopted.parameters) {
    const bool plain = parameter.unit == "1" || !parameter.run.empty();
    text +=
        fmt::format("{}{} = {}{} [{:.4g}, {:.4g}]{}", text.empty() ? "" : ", ", parameter.name,
                    parameter.run.empty() ? fmt::format("{:.4g}", parameter.value)
                                          : fmt::format("{} (run {:.0f})", parameter.run, parameter.value),
                    plain ? "" : " " + parameter.unit, parameter.low, parameter.high,
                    parameter.theory ? " (theory)" : "");
    if (parameter.groups.empty()) continue;
    const auto [least, most] =
        std::minmax_element(parameter.groups.begin(), parameter.groups.end(),
                            [](const GroupEstimate& a, const GroupEstimate& b) { return a.value < b.value; });
    text += fmt::format(", the median of {} groups from {:.4g} ({}) to {:.4g} ({})", parameter.groups.size(),
                        least->value, least->group, most->value, most->group);
  }
  return text;
}

std::string detectable_in_words(const Explanation& e, const std::string& unit) {
  std::string text = fmt::format("no effect above {:.3g}{} (rms) at 80 % power", e.detectable, unit);
  if (e.detectable_by_effect.size() > 1) {
    const auto [least, most] =
        std::minmax_element(e.detectable_by_effect.begin(), e.detectable_by_effect.end(),
                            [](const auto& a, const auto& b) { return a.second < b.second; });
    text += fmt::format("; {} would have been seen from {:.3g}{}, {} from {:.3g}{}", least->first,
                        least->second, unit, most->first, most->second, unit);
  }
  return text + "\n";
}

/// Lines that a terminal shows whole, indented.
std::string wrapped(const std::string& text) {
  constexpr std::size_t kWidth = 100;
  std::string result, line = "  ";
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find(' ', begin), text.size());
    if (line.size() + end - begin > kWidth) {
      result += line + "\n";
      line = "     ";
    }
    line += text.substr(begin, end - begin) + " ";
    begin = end + 1;
  }
  line.pop_back();
  return result + line + "\n";
}

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

}  // namespace

std::string verdict_in_words(const std::string& verdict) {
  if (verdict == "explained") return "The effects below explain what the model lacked.";
  if (verdict == "partly_explained")
    return "The effects below explain a part; structure without a name remains.";
  if (verdict == "confounded")
    return "An effect is there, but these data cannot tell which of several it is.";
  if (verdict == "unknown")
    return "There is structure, but no candidate accounts for it: the cause is not known.";
  if (verdict == "no_structure") return "Nothing beyond chance was found.";
  return "There are too few blocks, or runs, to say anything.";
}

std::string explanation_json(const Explanation& e) {
  Json json{{"format", "tunnelrig-explain/1"},
            {"campaign", e.campaign},
            {"response", e.response},
            {"unit", e.unit},
            {"baseline", e.baseline},
            {"verdict", e.verdict},
            {"noise_floor", finite(e.noise_floor)},
            {"blocks", e.blocks},
            {"runs", e.runs},
            {"before", error_json(e.before)},
            {"after", error_json(e.after)},
            {"adopted", Json::array()},
            {"unknown", Json::array()},
            {"untestable", Json::array()},
            {"suspect_rows", Json::array()},
            {"detectable_at_80_percent_power", finite(e.detectable)},
            {"detectable_by_effect", e.detectable_by_effect},
            {"empirical", e.empirical},
            {"warnings", e.warnings}};
  for (const AdoptedEffect& adopted : e.adopted) json["adopted"].push_back(adopted_json(adopted));
  for (const UnknownStructure& unknown : e.unknown) json["unknown"].push_back(unknown_json(unknown));
  for (const Untestable& entry : e.untestable)
    json["untestable"].push_back(
        {{"effect", entry.effect}, {"missing", entry.missing}, {"reason", entry.reason}});
  for (const SuspectRow& row : e.suspect_rows)
    json["suspect_rows"].push_back(
        {{"row", row.row}, {"studentised", finite(row.studentised)}, {"set_aside", row.set_aside}});
  return json.dump(1);
}

std::string explanation_text(const Explanation& e) {
  const std::string unit = e.unit_suffix();
  std::string text = fmt::format("{}{}response {}, baseline {}, {} runs in {} block{}\n\n{}: {}\n",
                                 e.campaign, e.campaign.empty() ? "" : ": ", e.response, e.baseline, e.runs,
                                 e.blocks, e.blocks == 1 ? "" : "s", e.verdict, verdict_in_words(e.verdict));
  for (const AdoptedEffect& a : e.adopted) {
    text += fmt::format("\n  {}   p = {:.3g}\n    {}\n    {}\n", a.term.label(), a.p_value,
                        a.term.effect->formula, parameters_in_words(a));
    if (!a.confounded_with.empty())
      text += fmt::format("    not to be told from: {}\n", joined(a.confounded_with));
    if (!a.separating_run && !a.confounded_with.empty() && !a.term.per_group)
      text += "    no run within reach would tell them apart\n";
    if (a.separating_run) text += fmt::format("    would tell: {}\n", a.separating_run->text);
  }
  for (const UnknownStructure& u : e.unknown) {
    const bool plain = u.covariate_unit.empty() || u.covariate_unit == "1";
    text += fmt::format("\n  unknown: depends on {}{}{}{}, amplitude {:.3g}{}, p = {:.3g}\n", u.covariate,
                        plain ? "" : " [" + u.covariate_unit + "]", u.times.empty() ? "" : " × " + u.times,
                        u.rotor < 0 ? "" : fmt::format(" of rotor {}", u.rotor + 1), u.amplitude, unit,
                        u.p_value);
    if (!u.place.empty()) text += fmt::format("    {}\n", place_in_words(u.place));
    if (!u.times.empty())
      text += fmt::format(
          "    in proportion to how far {0} is from its mean; drawn as it is where {0} is farthest\n",
          u.times);
    if (u.levels) text += wrapped("  " + levels_in_words(u, unit));
    if (!u.instead_of.empty())
      text += fmt::format("    in which it bends away from the formula of {}\n", joined(u.instead_of));
  }
  text += fmt::format(
      "\nerror on blocks held out{}: before {:.4g} [{:.4g}, {:.4g}], after {:.4g} [{:.4g}, {:.4g}], noise "
      "floor {:.4g}\n",
      unit.empty() ? "" : " [" + e.unit + "]", e.before.held_out_rmse, e.before.held_out_low,
      e.before.held_out_high, e.after.held_out_rmse, e.after.held_out_low, e.after.held_out_high,
      e.noise_floor);
  if (!e.empirical.empty())
    text += fmt::format("after is with the empirical curve over {}\n", joined(e.empirical));
  if (e.verdict == "no_structure") text += detectable_in_words(e, unit);
  if (!e.untestable.empty()) {
    text += "\nnot testable with these data:\n";
    std::map<std::string, std::vector<std::string>> by_reason;
    std::vector<std::string> not_recorded;
    for (const Untestable& u : e.untestable)
      if (u.missing.empty())
        by_reason[u.reason].push_back(u.effect);
      else
        not_recorded.push_back(fmt::format("{} ({})", u.effect, joined(u.missing)));
    for (const auto& [reason, effects] : by_reason)
      text += wrapped(fmt::format("{}: {}", reason, joined(effects)));
    if (!not_recorded.empty()) text += wrapped("its condition was not recorded: " + joined(not_recorded));
  }
  for (const SuspectRow& row : e.suspect_rows)
    text += row.studentised == 0 ? fmt::format("set aside: {}\n", row.row)
                                 : fmt::format("suspect: {} is {:.1f} standard deviations off{}\n", row.row,
                                               row.studentised, row.set_aside ? "; set aside" : "");
  return text;
}

}  // namespace tunnelrig
