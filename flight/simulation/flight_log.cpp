#include "flight/simulation/flight_log.h"

#include "flight/simulation/flight.h"

#include <iterator>

#include <fmt/format.h>

namespace tunnelrig {

void FlightLog::reserve(double duration_s) {
  const auto cycles = static_cast<std::size_t>(duration_s * kControlRate_Hz) + 1;
  rows.reserve(cycles / static_cast<std::size_t>(every) + 1);
  residuals.reserve(cycles / 600 + 1);
}

std::string format_log(const FlightLog& log) {
  std::string text =
      "time_s,reference_y_m,reference_z_m,y_m,z_m,estimate_y_m,estimate_z_m,velocity_y_m_s,velocity_z_m_s,x_"
      "m,roll_rad,"
      "roll_target_rad,thrust_m_s2\n";
  for (const LogRow& r : log.rows) {
    fmt::format_to(
        std::back_inserter(text),
        "{:.4f},{:.5f},{:.5f},{:.5f},{:.5f},{:.5f},{:.5f},{:.5f},{:.5f},{:.4f},{:.5f},{:.5f},{:.4f}\n",
        r.time_s, r.reference_m[0], r.reference_m[1], r.position_m[0], r.position_m[1], r.estimate_m[0],
        r.estimate_m[1], r.velocity_m_s[0], r.velocity_m_s[1], r.x_m, r.roll_rad, r.roll_target_rad,
        r.thrust_m_s2);
  }
  return text;
}

}  // namespace tunnelrig
