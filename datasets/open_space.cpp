#include "datasets/open_space.h"

namespace tunnelrig {

bool in_open_space(const Run& run) {
  return !run.in_tunnel() &&
         (run.location == "OS" || run.location.starts_with("GND") || run.location.starts_with("CEIL") ||
          run.number("ground_distance_R") || run.number("ceiling_distance_R"));
}

}  // namespace tunnelrig
