// `explain --list`: what is tried, and whether these data can show it.
#include "analysis/residual/explanation/explanation_output.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

namespace tunnelrig {

using Json = nlohmann::ordered_json;

std::string candidates_text(const std::vector<const Effect*>& effects, const CanBeFound* can_be_found) {
  std::string text;
  for (const Effect* effect : effects) {
    text +=
        fmt::format("{}{}\n    {}\n    {}\n", effect->name,
                    effect->form.empty() ? "" : " (" + effect->form + ")", effect->formula, effect->physics);
    for (const EffectParameter& p : effect->parameters) {
      text += p.role == ParameterRole::kChangePoint
                  ? fmt::format("    {}: at a session's first run\n", p.name)
                  : fmt::format("    {} [{}] from {} to {}{}\n", p.name, p.unit, p.lower, p.upper,
                                p.theory ? fmt::format(", theory {}", *p.theory) : "");
    }
    text += fmt::format("    sign: {}\n    needs: {}\n", effect->sign_rule,
                        effect->covariates.empty() ? "nothing measured"
                                                   : fmt::format("{}", fmt::join(effect->covariates, ", ")));
    if (can_be_found != nullptr) {
      const Testability can = (*can_be_found)(*effect);
      text += can.ok() ? "    testable\n"
              : can.missing.empty()
                  ? fmt::format("    not testable: {}\n", can.reason)
                  : fmt::format("    not testable: not recorded: {}\n", fmt::join(can.missing, ", "));
    }
  }
  return text;
}

std::string candidates_json(const std::vector<const Effect*>& effects, const CanBeFound* can_be_found) {
  Json list = Json::array();
  for (const Effect* effect : effects) {
    Json parameters = Json::array();
    for (const EffectParameter& p : effect->parameters)
      parameters.push_back({{"name", p.name},
                            {"unit", p.unit},
                            {"lower", p.lower},
                            {"upper", p.upper},
                            {"theory", p.theory ? Json(*p.theory) : Json(nullptr)}});
    Json entry{{"effect", effect->name},     {"form", effect->form},     {"formula", effect->formula},
               {"physics", effect->physics}, {"parameters", parameters}, {"covariates", effect->covariates},
               {"sign", effect->sign_rule}};
    if (can_be_found != nullptr) {
      const Testability can = (*can_be_found)(*effect);
      entry["testable"] = can.ok();
      entry["missing"] = can.missing;
      entry["reason"] = can.reason;
    }
    list.push_back(std::move(entry));
  }
  return list.dump(1);
}

}  // namespace tunnelrig
