#include "cli/manual/man_page.h"

#include "cli/verbs.h"

#include <algorithm>
#include <cctype>
#include <sstream>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace tunnelrig::cli {
namespace {

/// Text as roff takes it: hyphens that can be copied, no line that begins with a request.
std::string roff(const std::string& text) {
  std::string out;
  bool line_begins = true;
  for (const char c : text) {
    if (line_begins && (c == '.' || c == '\'')) out += "\\&";
    if (c == '\\')
      out += "\\e";
    else if (c == '-')
      out += "\\-";
    else
      out += c;
    line_begins = c == '\n';
  }
  return out;
}

std::string quoted_argument(const std::string& text) {
  std::string out;
  for (const char c : roff(text)) out += c == '"' ? std::string("\\(dq") : std::string(1, c);
  return "\"" + out + "\"";
}

std::string heading(const std::string& name, const std::string& what, const ManualPlaces& places) {
  std::string upper = name;
  for (char& c : upper) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return fmt::format(".TH {} 1 \"{}\" {} \"tunnelrig\"\n.SH NAME\n{} \\- {}\n", quoted_argument(upper),
                     places.date, quoted_argument("tunnelrig " + places.version), roff(name), roff(what));
}

/// Paragraphs: blank lines part them.
std::string paragraphs(const std::string& text) {
  std::string out;
  std::istringstream lines(text);
  bool begun = false;
  for (std::string line; std::getline(lines, line);) {
    if (line.empty())
      begun = false;
    else
      out += (std::exchange(begun, true) ? ".br\n" : ".PP\n") + roff(line) + "\n";
  }
  return out;
}

/// The footer of a verb: what it says, and its examples, a command each.
struct Footer {
  std::string text;
  std::vector<std::string> examples;
};

Footer parts_of(const std::string& footer) {
  Footer parts;
  std::istringstream lines(footer);
  bool examples = false;
  for (std::string line; std::getline(lines, line);) {
    for (const char* mark : {"Examples: ", "Example: "}) {
      if (!line.starts_with(mark)) continue;
      examples = true;
      line.erase(0, std::string_view(mark).size());
    }
    line.erase(0, std::min(line.find_first_not_of(' '), line.size()));
    if (!examples)
      parts.text += line + "\n";
    else if (!line.empty())
      parts.examples.push_back(line);
  }
  return parts;
}

std::string option_entry(const CLI::Option& option, bool positional) {
  const std::string name = positional ? option.get_name(true) : option.get_name(false, true);
  return fmt::format(".TP\n\\fB{}\\fR{}\n{}\n", roff(name), roff(CLI::Formatter().make_option_opts(&option)),
                     roff(option.get_description()));
}

std::string options_section(const CLI::App& app) {
  std::string out;
  for (const CLI::Option* option : app.get_options())
    if (option->get_positional()) out += option_entry(*option, true);
  if (!out.empty()) out = ".SH ARGUMENTS\n" + out;
  out += ".SH OPTIONS\n";
  for (const CLI::Option* option : app.get_options())
    if (!option->get_positional()) out += option_entry(*option, false);
  return out;
}

std::string exit_status() { return fmt::format(".SH EXIT STATUS\n{}\n", roff(kExitCodes)); }

std::string documents(const ManualPlaces& places) {
  return fmt::format(".SH FILES\nDocuments, which this page names by docs/: {}\n", roff(places.documents));
}

}  // namespace

std::vector<const CLI::App*> verbs_of(const CLI::App& program) {
  return program.get_subcommands([](const CLI::App* verb) { return !verb->get_name().empty(); });
}

std::string man_page(const CLI::App& program, const ManualPlaces& places) {
  const std::string described = kProgramDescription;
  std::string page = heading("tunnelrig", described.substr(described.find(": ") + 2), places);
  page +=
      ".SH SYNOPSIS\n\\fBtunnelrig\\fR \\fIVERB\\fR [\\fIOPTIONS\\fR]\n.br\n\\fBtunnelrig\\fR \\fIVERB\\fR "
      "\\-\\-help\n";
  page += options_section(program) + ".SH VERBS\n";
  std::string see;
  for (const CLI::App* verb : verbs_of(program)) {
    page += fmt::format(".TP\n\\fB{}\\fR\n{}\n", roff(verb->get_name()), roff(verb->get_description()));
    see += fmt::format("{}.BR tunnelrig\\-{} (1)", see.empty() ? "" : ",\n", roff(verb->get_name()));
  }
  return page + exit_status() + documents(places) + ".SH SEE ALSO\n" + see + "\n";
}

std::string man_page_of_verb(const CLI::App& program, const CLI::App& verb, const ManualPlaces& places) {
  const Footer footer = parts_of(verb.get_footer());
  std::string page = heading("tunnelrig-" + verb.get_name(), verb.get_description(), places);
  page += fmt::format(".SH SYNOPSIS\n\\fBtunnelrig {}\\fR [\\fIOPTIONS\\fR]", roff(verb.get_name()));
  for (const CLI::Option* option : verb.get_options())
    if (option->get_positional()) page += fmt::format(" \\fI{}\\fR", roff(option->get_name(true)));
  page += "\n";
  if (const std::string text = paragraphs(footer.text); !text.empty())
    page += ".SH DESCRIPTION\n" + text.substr(4);
  page += options_section(verb);
  if (!footer.examples.empty()) page += ".SH EXAMPLES\n.nf\n";
  for (const std::string& example : footer.examples) page += roff(example) + "\n";
  if (!footer.examples.empty()) page += ".fi\n";
  return page + exit_status() + documents(places) + ".SH SEE ALSO\n.BR " + roff(program.get_name()) +
         " (1)\n";
}

}  // namespace tunnelrig::cli
