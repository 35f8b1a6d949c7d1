#include "analysis/report/render.h"

#include "analysis/report/page_parts.h"

#include <array>
#include <cassert>
#include <utility>

namespace tunnelrig {
namespace {

/// JSON that a script element can hold: "<" occurs in its strings only, and there it may be written so.
/// Nothing else ends the element or opens a comment in it.
std::string escaped(std::string_view json) {
  std::string text;
  text.reserve(json.size());
  for (const char c : json) {
    if (c == '<')
      text += "\\u003c";
    else
      text += c;
  }
  return text;
}

std::string render(std::string_view json, std::string_view script) {
  const std::string data = escaped(json);
  const std::array<std::pair<std::string_view, std::string_view>, 4> parts = {
      {{"style", report::page_style()}, {"plotly", report::plotly()}, {"data", data}, {"script", script}}};
  std::string page;
  std::string_view rest = report::page_template();
  for (const auto& [name, text] : parts) {  // in the template's order
    const std::string mark = "{{" + std::string(name) + "}}";
    const auto at = rest.find(mark);
    assert(at != std::string_view::npos);
    page.append(rest.substr(0, at)).append(text);
    rest.remove_prefix(at + mark.size());
  }
  return page.append(rest);
}

}  // namespace

std::string render_report(std::string_view json) { return render(json, report::page_script()); }
std::string render_explanation(std::string_view json) { return render(json, report::explanation_script()); }

}  // namespace tunnelrig
