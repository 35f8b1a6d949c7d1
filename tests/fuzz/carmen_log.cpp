// Any text as a CARMEN log; what reads as a scan is made into a section too.
#include "flight/lidar/carmen_log.h"

#include "flight/localisation/scan_section.h"
#include "fuzz/input.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tunnelrig;
  fuzz::expect_answer([&] {
    for (const CarmenScan& scan : parse_carmen_log(fuzz::as_text(data, size), "fuzz.log"))
      section_from_scan(scan.scan, carmen_layout(scan.scan.range_m.size()));
  });
  return 0;
}
