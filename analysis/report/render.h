// The pages: their template, style, scripts and Plotly, which are embedded in the library, with the
// data.
#pragma once

#include <string>
#include <string_view>

namespace tunnelrig {

/// One HTML file that asks for nothing else. `json` is ReportData::json; whatever texts it holds, they stay
/// texts.
std::string render_report(std::string_view json);

/// The same of an explanation; `json` is made by explanation_html.
std::string render_explanation(std::string_view json);

}  // namespace tunnelrig
