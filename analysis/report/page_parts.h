// The files of page/, and Plotly, as they were when the program was built. Internal to analysis/report.
#pragma once

#include <string_view>

namespace tunnelrig::report {

std::string_view page_template();       // page/report.html
std::string_view page_style();          // page/report.css
std::string_view page_script();         // page/*.js of the report, one after the other
std::string_view explanation_script();  // and of the explanation
std::string_view plotly();

}  // namespace tunnelrig::report
