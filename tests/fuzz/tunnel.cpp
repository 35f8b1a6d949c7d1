// Any text as a tunnel file.
#include "flight/tunnel/tunnel.h"

#include "fuzz/input.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tunnelrig;
  fuzz::expect_answer([&] { parse_tunnel(std::string(fuzz::as_text(data, size)), "fuzz.toml"); });
  return 0;
}
