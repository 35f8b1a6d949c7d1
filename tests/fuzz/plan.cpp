// Any text as a plan of runs, as a list of locations, and as the faults of the virtual board.
#include "daq/faults.h"
#include "daq/run_plan.h"
#include "fuzz/input.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tunnelrig;
  fuzz::expect_answer([&] { parse_faults(std::string(fuzz::as_text(data, size))); });
  fuzz::expect_answer([&] {
    const Sheet sheet = parse_csv(fuzz::as_text(data, size), "fuzz.csv");
    fuzz::expect_answer([&] { parse_plan(sheet); });
    fuzz::expect_answer([&] { parse_locations(sheet); });
  });
  return 0;
}
