// The files of page/, and Plotly, as they were when the program was built. Internal to analysis/report.
#pragma once

#include <string_view>

namespace tunnelrig::report {

std::string_view page_template();  // page/report.html
std::string_view page_style();     // page/report.css
std::string_view page_script();    // page/*.js, one after the other
std::string_view plotly();

}  // namespace tunnelrig::report
