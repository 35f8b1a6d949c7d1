#include "analysis/report/page_parts.h"

#include "cmake/embed.h"

// TUNNELRIG_…_FILE are paths, which CMakeLists.txt defines.
TUNNELRIG_EMBED(tunnelrig_page_template, TUNNELRIG_TEMPLATE_FILE)
TUNNELRIG_EMBED(tunnelrig_page_style, TUNNELRIG_STYLE_FILE)
TUNNELRIG_EMBED(tunnelrig_page_script, TUNNELRIG_SCRIPT_FILE)
TUNNELRIG_EMBED(tunnelrig_explanation_script, TUNNELRIG_EXPLANATION_SCRIPT_FILE)
TUNNELRIG_EMBED(tunnelrig_plotly, TUNNELRIG_PLOTLY_FILE)

namespace tunnelrig::report {

std::string_view page_template() { return {tunnelrig_page_template, tunnelrig_page_template_size}; }
std::string_view page_style() { return {tunnelrig_page_style, tunnelrig_page_style_size}; }
std::string_view page_script() { return {tunnelrig_page_script, tunnelrig_page_script_size}; }
std::string_view explanation_script() {
  return {tunnelrig_explanation_script, tunnelrig_explanation_script_size};
}
std::string_view plotly() { return {tunnelrig_plotly, tunnelrig_plotly_size}; }

}  // namespace tunnelrig::report
