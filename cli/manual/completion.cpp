#include "cli/manual/completion.h"

#include "cli/manual/man_page.h"

#include <algorithm>

#include <fmt/format.h>

namespace tunnelrig::cli {
namespace {

std::string options_of(const CLI::App& app) {
  std::string words;
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) words += (words.empty() ? "--" : " --") + name;
  }
  return words;
}

/// "thrust tare" of a type "TEXT:{thrust,tare}"; empty where there is no choice.
std::string choice_of(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  const auto from = type.find('{'), to = type.find('}');
  if (from == std::string::npos || to == std::string::npos || to < from) return {};
  std::string words = type.substr(from + 1, to - from - 1);
  std::replace(words.begin(), words.end(), ',', ' ');
  return words;
}

bool takes_a_number(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  return type.starts_with("INT") || type.starts_with("UINT") || type.starts_with("FLOAT");
}

/// What follows an option, as a case of `verb option`; empty for flags.
std::string value_case(const CLI::App& verb, const CLI::Option& option) {
  if (option.get_positional() || option.get_type_size() == 0 || option.get_lnames().empty()) return {};
  const std::string choice = choice_of(option);
  const std::string& name = option.get_lnames().front();
  std::string action = "_tunnelrig_files";
  if (!choice.empty())
    action = fmt::format("_tunnelrig_words '{}'", choice);
  else if (takes_a_number(option))
    action = ":";
  else if (name == "db")
    action = "_tunnelrig_files '.*\\.db$'";
  return fmt::format("    '{} --{}') {}; return ;;\n", verb.get_name(), name, action);
}

bool has_arguments(const CLI::App& verb) {
  const auto options = verb.get_options();
  return std::any_of(options.begin(), options.end(),
                     [](const CLI::Option* o) { return o->get_positional(); });
}

constexpr const char* kHelpers = R"(# Completion of tunnelrig(1) in bash; made from the program's own options.

_tunnelrig_words() { mapfile -t COMPREPLY < <(compgen -W "$1" -- "$current"); }

# Files, of a pattern where one is given; folders always.
_tunnelrig_files() {
  local file
  compopt -o filenames 2>/dev/null
  COMPREPLY=()
  while IFS= read -r file; do
    [[ -d $file || -z ${1-} || $file =~ ${1-} ]] && COMPREPLY+=("$file")
  done < <(compgen -f -- "$current")
}

_tunnelrig() {
  local current=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD - 1]} verb=
  COMPREPLY=()
  ((COMP_CWORD > 1)) && verb=${COMP_WORDS[1]}
)";

}  // namespace

std::string bash_completion(const CLI::App& program) {
  std::string names, values, options, arguments;
  for (const CLI::App* verb : verbs_of(program)) {
    names += verb->get_name() + " ";
    for (const CLI::Option* option : verb->get_options()) values += value_case(*verb, *option);
    options += fmt::format("    {}) _tunnelrig_words '{}' ;;\n", verb->get_name(), options_of(*verb));
    if (has_arguments(*verb)) arguments += (arguments.empty() ? "" : "|") + verb->get_name();
  }
  std::string script = kHelpers;
  script +=
      fmt::format("  [[ -z $verb ]] && {{ _tunnelrig_words '{}{}'; return; }}\n", names, options_of(program));
  script += "  case \"$verb $previous\" in\n" + values + "  esac\n";
  if (!arguments.empty())
    script += fmt::format("  [[ $current != -* && $verb =~ ^({})$ ]] && {{ _tunnelrig_files; return; }}\n",
                          arguments);
  script += "  case $verb in\n" + options + "  esac\n}\n\ncomplete -F _tunnelrig tunnelrig\n";
  return script;
}

}  // namespace tunnelrig::cli
