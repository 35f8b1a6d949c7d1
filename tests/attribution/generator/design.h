// When and where the runs of a campaign take place, and under which conditions.
#pragma once

#include "attribution/generator/random.h"
#include "attribution/generator/settings.h"
#include "attribution/generator/world.h"

namespace tunnelrig::attribution {

/// What an effect needs in order to be seen, or a confounded pair in order not to be told apart.
struct Design {
  enum class Places {
    kGrid,       // the 42 locations of the tunnel and OS
    kTunnel,     // the tunnel's only
    kReference,  // the grid, and a quarter of all runs at OS
    kOpenSpace   // OS, GND, CEIL
  };
  Places places = Places::kGrid;
  double thrust_spread = 0.02;  // of the rotors' coefficients between locations, relative
  bool sagging_supply = false;  // falls in proportion to the time in the session and with nothing else
  double speed_scatter_rpm = 5.5;
  double pressure_swing_Pa = 450;  // of the weather
  double warmth_swing_K = 1.5;     // of the weather
  double cell_swing_K = 0.9;       // of a cell's temperature within hours
  bool hot_weather = false;        // humid air weighs less than dry air only where it is warm
};

/// Runs with all their conditions, and the baseline's thrusts.
World plan_world(const Settings& settings, const Design& design);

}  // namespace tunnelrig::attribution
