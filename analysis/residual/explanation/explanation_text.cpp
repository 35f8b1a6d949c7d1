#include "analysis/residual/explanation/explanation_output.h"

#include <algorithm>
#include <iterator>
#include <map>
#include <set>
#include <string>
#include <vector>

#include <fmt/format.h>

namespace tunnelrig {
namespace {

std::string name_of_value(const UnknownStructure& unknown, double x) {
  if (unknown.labels.empty()) return fmt::format("{:g}", x);
  const std::string& label = unknown.labels[static_cast<std::size_t>(x) - 1];
  return label.empty() ? "(empty)" : label;
}

/// What each text or, of few, each value makes: "A -0.012 ± 0.003, B +0.012 ± 0.003 N (± at 95 %)".
std::string levels_in_words(const UnknownStructure& unknown, const std::string& unit) {
  std::string text;
  for (const ShapePoint& point : unknown.shape)
    text += fmt::format("{}{} {:+.3g} ± {:.2g}", text.empty() ? "" : ", ", name_of_value(unknown, point.x),
                        point.y, (point.high - point.low) / 2);
  return text + unit + " (± at 95 %)";
}

std::string place_in_words(const std::string& place) {
  if (place == "tunnel") return "in the tunnel, compared with open space";
  return fmt::format("in proportion to {} of the location; drawn as it is at {} = 1", place, place);
}

/// The amplitudes of the groups that tell one: of the others the interval is wider than physics.
std::vector<GroupEstimate> telling(const std::vector<GroupEstimate>& groups, const EffectParameter& bounds) {
  std::vector<GroupEstimate> result;
  std::ranges::copy_if(groups, std::back_inserter(result), [&](const GroupEstimate& group) {
    return group.high - group.low < bounds.upper - bounds.lower;
  });
  return result.empty() ? groups : result;
}

std::string parameters_in_words(const AdoptedEffect& adopted) {
  std::string text;
  for (std::size_t k = 0; k < adopted.parameters.size(); ++k) {
    const ParameterEstimate& parameter = adopted.parameters[k];
    const bool plain = parameter.unit == "1" || !parameter.run.empty();
    text +=
        fmt::format("{}{} = {}{} [{:.4g}, {:.4g}]{}", text.empty() ? "" : ", ", parameter.name,
                    parameter.run.empty() ? fmt::format("{:.4g}", parameter.value)
                                          : fmt::format("{} (run {:.0f})", parameter.run, parameter.value),
                    plain ? "" : " " + parameter.unit, parameter.low, parameter.high,
                    parameter.theory ? " (theory)" : "");
    if (parameter.groups.empty()) continue;
    const std::vector<GroupEstimate> groups = telling(parameter.groups, adopted.term.effect->parameters[k]);
    const auto [least, most] = std::ranges::minmax_element(groups, {}, &GroupEstimate::value);
    text += fmt::format(", the median of {} groups from {:.4g} ({}) to {:.4g} ({})", parameter.groups.size(),
                        least->value, least->group, most->value, most->group);
    if (groups.size() < parameter.groups.size())
      text += fmt::format("; of {} nothing is known", parameter.groups.size() - groups.size());
  }
  return text;
}

/// The only name that the search held against the data; empty: there are others.
std::string only_name_tried(const Explanation& e) {
  std::set<std::string> names;
  if (!e.rounds.empty())
    for (const Ranked& ranked : e.rounds[0].ranking) names.insert(ranked.term.effect->name);
  return names.size() == 1 ? *names.begin() : "";
}

std::string detectable_in_words(const Explanation& e, const std::string& unit) {
  std::string text = fmt::format("no effect above {:.3g}{} (rms) at 80 % power", e.detectable, unit);
  if (e.detectable_by_effect.size() > 1) {
    const auto [least, most] =
        std::minmax_element(e.detectable_by_effect.begin(), e.detectable_by_effect.end(),
                            [](const auto& a, const auto& b) { return a.second < b.second; });
    text += fmt::format("; {} would have been seen from {:.3g}{}, {} from {:.3g}{}", least->first,
                        least->second, unit, most->first, most->second, unit);
  } else if (const std::string name = only_name_tried(e); !name.empty()) {
    text += fmt::format("; these data test no name but {}", name);
  }
  return text + "\n";
}

/// Lines that a terminal shows whole, indented.
std::string wrapped(const std::string& text) {
  constexpr std::size_t kWidth = 100;
  std::string result, line = " ";
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find(' ', begin), text.size());
    if (line.size() + end - begin >= kWidth) {
      result += line + "\n";
      line = "    ";
    }
    line += " " + text.substr(begin, end - begin);
    begin = end + 1;
  }
  return result + line + "\n";
}

std::string in_words(const AdoptedEffect& a) {
  std::string text = fmt::format("\n  {}   p = {:.3g}\n    {}\n    {}\n", a.term.label(), a.p_value,
                                 a.term.effect->formula, parameters_in_words(a));
  if (!a.confounded_with.empty())
    text += fmt::format("    not to be told from: {}\n", fmt::join(a.confounded_with, ", "));
  if (!a.separating_run && !a.confounded_with.empty() && !a.term.per_group)
    text += "    no run within reach would tell them apart\n";
  if (a.separating_run) text += fmt::format("    would tell: {}\n", a.separating_run->text);
  return text;
}

std::string names_in_words(const UnknownStructure& u, bool on_all_blocks) {
  std::vector<std::string> names;
  for (const auto& [term, of_all] : u.could_be)
    if (of_all == on_all_blocks)
      names.push_back(term.effect->name +
                      (term.rotor < 0 ? "" : fmt::format(" of rotor {}", term.rotor + 1)) +
                      (term.at_theory ? " at theory's coefficient" : ""));
  return fmt::format("{}", fmt::join(names, ", or "));
}

std::string could_be_in_words(const UnknownStructure& u) {
  std::string text;
  if (const std::string names = names_in_words(u, false); !names.empty())
    text += wrapped(
        fmt::format("  {} may have a part in it: found before it, and not beyond chance beside it", names));
  if (const std::string names = names_in_words(u, true); !names.empty())
    text += wrapped(
        fmt::format("  {}{} would do as well, and could not be scored any more: more sessions would tell",
                    u.by_sealed_too ? "" : "with the sealed blocks in, ", names));
  return text;
}

std::string in_words(const UnknownStructure& u, const Explanation& explanation) {
  constexpr double kLittle = 0.5;
  const std::string unit = explanation.unit_suffix();
  const bool relative = explanation.relative_to > 0 && u.covariate != "session";
  const bool plain = u.covariate_unit.empty() || u.covariate_unit == "1";
  std::string text = fmt::format(
      "\n  unknown: depends on {}{}{}{}, amplitude {:.3g}{}{}, p = {:.3g}\n", u.covariate,
      plain ? "" : " [" + u.covariate_unit + "]", u.times.empty() ? "" : " × " + u.times,
      u.rotor < 0 ? "" : fmt::format(" of rotor {}", u.rotor + 1), u.amplitude, unit,
      relative ? fmt::format(" ({:.3g} %)", 100 * u.amplitude / explanation.relative_to) : "", u.p_value);
  if (u.beside_baseline < kLittle * u.amplitude)
    text +=
        fmt::format("    the baseline could make all but {:.3g}{} of it as well\n", u.beside_baseline, unit);
  if (!u.place.empty()) text += fmt::format("    {}\n", place_in_words(u.place));
  if (!u.times.empty())
    text += fmt::format(
        "    in proportion to how far {0} is from its mean; drawn as it is where {0} is farthest\n", u.times);
  if (u.levels) text += wrapped("  " + levels_in_words(u, unit));
  if (u.by_sealed_too)
    text +=
        "    only with the sealed blocks in: the others are too few to show it, so it is not in the errors\n";
  if (!u.collinear_with.empty())
    text += wrapped(
        fmt::format("  not to be told from {}, which goes with it", fmt::join(u.collinear_with, ", ")));
  text += could_be_in_words(u);
  if (!u.instead_of.empty())
    text += fmt::format("    in which it bends away from the formula of {}\n", fmt::join(u.instead_of, ", "));
  return text;
}

std::string errors_in_words(const Explanation& e) {
  std::string text = fmt::format(
      "\nerror on blocks held out{}: before {:.4g} [{:.4g}, {:.4g}], after {:.4g} [{:.4g}, {:.4g}], noise "
      "floor {:.4g}\n",
      e.unit_suffix().empty() ? "" : " [" + e.unit + "]", e.before.held_out_rmse, e.before.held_out_low,
      e.before.held_out_high, e.after.held_out_rmse, e.after.held_out_low, e.after.held_out_high,
      e.noise_floor);
  if (!e.empirical.empty())
    text += fmt::format("after is with the empirical curve over {}\n", fmt::join(e.empirical, ", "));
  const bool scored = std::ranges::any_of(e.unknown, &UnknownStructure::is_curve_of_model);
  if (scored && e.empirical.empty())
    text += "what has no name is in neither: --adopt-empirical gives the error with its curves\n";
  return text;
}

/// By reason, so that none stands there twice.
std::string in_words(const std::vector<Untestable>& untestable) {
  if (untestable.empty()) return {};
  std::map<std::string, std::vector<std::string>> by_reason;
  std::vector<std::string> not_recorded;
  for (const Untestable& u : untestable)
    if (u.missing.empty() || u.effect == kStructure)
      by_reason[u.reason].push_back(u.effect);
    else
      not_recorded.push_back(fmt::format("{} ({})", u.effect, fmt::join(u.missing, ", ")));
  std::string text = "\nnot testable with these data:\n";
  for (const auto& [reason, effects] : by_reason)
    text += wrapped(fmt::format("{}: {}", reason, fmt::join(effects, ", ")));
  if (!not_recorded.empty())
    text += wrapped(fmt::format("its condition was not recorded: {}", fmt::join(not_recorded, ", ")));
  return text;
}

std::string in_words(const SuspectRow& row) {
  if (row.studentised == 0) return fmt::format("set aside: {}\n", row.row);
  return fmt::format("suspect: {} is {:.1f} standard deviations off{}\n", row.row, row.studentised,
                     row.set_aside ? "; set aside" : "");
}

}  // namespace

std::string verdict_in_words(const Explanation& e) {
  if (e.verdict == "insufficient") return "There are too few blocks, or runs, to say anything.";
  if (e.verdict == "no_structure") return "Nothing beyond chance goes with what is known of the runs.";
  if (e.verdict == "unknown")
    return "There is structure, but no candidate accounts for it: the cause is not known.";
  if (e.verdict == "partly_explained")
    return "The effects below explain a part; structure without a name remains.";
  const bool confounded = e.verdict == "confounded";
  if (e.after.held_out_rmse >= e.before.held_out_rmse)
    return confounded ? "An effect was found, of which these data cannot tell which of several it is, "
                        "and which does not predict the sealed blocks better."
                      : "The effects below were found, but they do not predict the sealed blocks better.";
  const std::string said = confounded
                               ? "An effect is there, but these data cannot tell which of several it is"
                               : "The effects below explain what the model lacked";
  return said + (e.sealed.beyond_floor ? ", and something else varies in the sealed blocks." : ".");
}

std::string explanation_text(const Explanation& e) {
  std::string text = fmt::format("{}{}response {}, baseline {}, {} runs in {} block{}\n", e.campaign,
                                 e.campaign.empty() ? "" : ": ", e.response, e.baseline, e.runs, e.blocks,
                                 e.blocks == 1 ? "" : "s");
  if (e.model_in_force > 0)
    text +=
        wrapped(fmt::format("model version {} is in force for reduce, map and report; explain starts anew "
                            "from the baseline {}",
                            e.model_in_force, e.baseline));
  text += fmt::format("\n{}: {}\n", e.verdict, verdict_in_words(e));
  for (const AdoptedEffect& adopted : e.adopted) text += in_words(adopted);
  for (const UnknownStructure& unknown : e.unknown) text += in_words(unknown, e);
  text += errors_in_words(e);
  if (e.verdict == "no_structure") text += detectable_in_words(e, e.unit_suffix());
  text += in_words(e.untestable);
  for (const SuspectRow& row : e.suspect_rows) text += in_words(row);
  return text;
}

}  // namespace tunnelrig
