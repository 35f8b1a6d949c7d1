// Any text as a stored certificate.
#include "calibration/certificate.h"

#include "fuzz/input.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tunnelrig;
  fuzz::expect_answer([&] { certificate_from_json(fuzz::as_text(data, size)); });
  return 0;
}
