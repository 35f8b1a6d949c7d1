// Any text as campaign.toml.
#include "datasets/campaign.h"
#include "fuzz/input.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tunnelrig;
  fuzz::expect_answer([&] { parse_campaign_toml(std::string(fuzz::as_text(data, size)), "fuzz.toml"); });
  return 0;
}
