// Any text as a file of gains; controllers take what is accepted.
#include "flight/controllers/any_controller.h"
#include "fuzz/input.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tunnelrig;
  fuzz::expect_answer([&] {
    const GainTable gains = parse_gains(fuzz::as_text(data, size), "fuzz.toml");
    for (const auto& [name, values] : gains) AnyController(name, gains, {}).step({});
  });
  return 0;
}
