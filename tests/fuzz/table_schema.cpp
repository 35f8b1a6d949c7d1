// Any text as the schema of a table, and a small table read by whatever it allows.
#include "datasets/observations.h"
#include "fuzz/input.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tunnelrig;
  static const Sheet table = parse_csv("T,N,D\n1,2,3\n4,5,6\n", "fuzz.csv");
  fuzz::expect_answer([&] {
    read_observations(table, parse_table_schema(std::string(fuzz::as_text(data, size)), "fuzz.toml"));
  });
  return 0;
}
