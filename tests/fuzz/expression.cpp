// Any text as an expression over columns, and its value where it is one.
#include "analysis/expression.h"

#include "fuzz/input.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tunnelrig;
  fuzz::expect_answer([&] {
    const Expression expression(fuzz::as_text(data, size), "fuzz.toml");
    expression(std::vector<double>(expression.names().size(), 0.5));
  });
  return 0;
}
