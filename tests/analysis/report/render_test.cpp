#include "analysis/report/render.h"

#include "support/occurrences.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace tunnelrig {
namespace {

using test::occurrences;
using testing::HasSubstr;
using testing::Not;

/// What the page's scripts read back.
nlohmann::json data_of(const std::string& page) {
  const std::string start = R"(<script type="application/json" id="data">)";
  const auto from = page.find(start) + start.size();
  return nlohmann::json::parse(page.substr(from, page.find("</script>", from) - from));
}

TEST(RenderReport, TextsCannotBreakThePage) {
  const std::string harmless = render_report(R"({"name":"x"})");
  for (const std::string name :
       {"</script><b>", "<!--<script>", "{{plotly}} {{script}}", "\xE2\x80\xA8 ' \" \\ &lt;"}) {
    const std::string page = render_report(nlohmann::json{{"name", name}}.dump());
    EXPECT_EQ(occurrences(page, "</script"), occurrences(harmless, "</script")) << name;
    EXPECT_EQ(occurrences(page, "<script"), occurrences(harmless, "<script")) << name;
    EXPECT_EQ(occurrences(page, "<!--"), occurrences(harmless, "<!--")) << name;
    EXPECT_EQ(data_of(page)["name"], name);
  }
}

TEST(RenderReport, IsOneWholeFileThatAsksForNothing) {
  const std::string page = render_report("{}");
  EXPECT_THAT(page, testing::StartsWith("<!DOCTYPE html>"));
  EXPECT_THAT(page, testing::EndsWith("</html>\n"));
  EXPECT_THAT(page, HasSubstr("default-src 'none'"));
  EXPECT_THAT(page, HasSubstr("Licensed under the MIT license"));  // Plotly's notice goes with it
  for (const char* part : {"{{style}}", "{{plotly}}", "{{data}}", "{{script}}", "<script src",
                           "<link rel=\"stylesheet\"", "@import"})
    EXPECT_THAT(page, Not(HasSubstr(part)));
  EXPECT_LT(page.size(), 3'000'000u);
}

}  // namespace
}  // namespace tunnelrig
