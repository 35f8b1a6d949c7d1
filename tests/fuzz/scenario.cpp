// Any text as a scenario; what is accepted is flown along on paper.
#include "flight/scenarios/scenario.h"

#include "fuzz/input.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tunnelrig;
  static const Airframe frame;
  static const FlightSpace space(tunnel_from("2.4"), frame);
  fuzz::expect_answer([&] {
    const Scenario scenario = parse_scenario(fuzz::as_text(data, size), "fuzz.toml");
    // Hours of path are looked at elsewhere: a target has to be quick.
    if (scenario.trajectory.duration_s() < 60) check_scenario(scenario, space, frame);
  });
  return 0;
}
