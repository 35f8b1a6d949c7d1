// Any bytes as the header of a .npy file.
#include "datasets/npy.h"

#include "fuzz/input.h"

#include <cstdlib>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tunnelrig;
  fuzz::expect_answer([&] {
    const NpyHeader header = parse_npy_header(fuzz::as_bytes(data, size), "fuzz.npy");
    if (header.data_offset > size || header.format.channels < 1 || header.format.channels > 4) std::abort();
  });
  return 0;
}
