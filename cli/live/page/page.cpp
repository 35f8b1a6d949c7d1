#include "cli/live/page/page.h"

#include "cmake/embed.h"

TUNNELRIG_EMBED(tunnelrig_live_page, TUNNELRIG_LIVE_PAGE_FILE)  // a path, which CMakeLists.txt defines

namespace tunnelrig::live {

std::string_view page_html() { return {tunnelrig_live_page, tunnelrig_live_page_size}; }

}  // namespace tunnelrig::live
