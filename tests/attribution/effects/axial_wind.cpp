#include "attribution/effects/catalogue.h"

namespace tunnelrig::attribution {

// Air along the tunnel crosses the discs: T (1 + w v^2).
Effect axial_wind(Random& random) {
  return {.name = "axial_wind",
          .covariates = {"tunnel_airspeed_m_s"},
          .change =
              [](const Place& at, double w) {
                const double v_m_s = at.conditions().tunnel_airspeed_m_s;
                return w * v_m_s * v_m_s;
              },
          .amplitude_unit = "s2/m2",
          .sign = random.sign()};
}

}  // namespace tunnelrig::attribution
