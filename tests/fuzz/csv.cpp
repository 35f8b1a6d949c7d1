// Any text as CSV: what is accepted is written back so that it reads the same; as runs, calibration and
// propellers it gets an answer.
#include "datasets/campaign.h"
#include "fuzz/input.h"

#include <cstdlib>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tunnelrig;
  static const CampaignInfo info = parse_campaign_toml(reference_campaign_toml(), "campaign.toml");
  fuzz::expect_answer([&] {
    const Sheet sheet = parse_csv(fuzz::as_text(data, size), "fuzz.csv");
    const Sheet again = parse_csv(format_csv(sheet), "fuzz.csv");
    if (again.columns != sheet.columns || again.rows.size() != sheet.rows.size()) std::abort();
    for (std::size_t i = 0; i < sheet.rows.size(); ++i) {
      if (again.rows[i].cells != sheet.rows[i].cells) std::abort();
    }
    fuzz::expect_answer([&] { parse_runs(sheet, info); });
    fuzz::expect_answer([&] { parse_calibration(sheet, 4); });
    fuzz::expect_answer([&] { parse_propellers(sheet, 4); });
  });
  return 0;
}
