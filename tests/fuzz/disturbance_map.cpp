// Any text as disturbance_map.json.
#include "analysis/maps/disturbance_map.h"

#include "fuzz/input.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tunnelrig;
  fuzz::expect_answer([&] { parse_disturbance_map(fuzz::as_text(data, size), "fuzz.json"); });
  return 0;
}
