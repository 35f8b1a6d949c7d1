// A disturbance field made to fit everything that the thesis says of the measured one.
//
// The thesis prints no table of its contours (5.58, 5.59), only numbers at a few places and claims about
// their shape. This field satisfies all of them and is smooth in between; it is an invention within those
// bounds, and the virtual rig measures it.
#pragma once

#include <array>

namespace tunnelrig {

/// C_T over that at the tunnel's origin, minus 1, at normalised coordinates (4.1, 4.2); even in y_norm, 0 at
/// the origin.
double published_thrust_change(double y_norm, double z_norm);

/// Uneven thrust U (5.1) as a fraction; odd in y_norm, negative (towards the wall) for y_norm > 0.
double published_uneven_thrust(double y_norm, double z_norm);

/// Thrust in open space above a ground plane over that without, at z/R; the height of the rotor plane in
/// radii.
double published_ground_ratio(double distance_R);

/// The same beneath a ceiling plane; 1.01 far away, as measured (Section 5.2.4).
double published_ceiling_ratio(double distance_R);

/// Share of the total thrust that rotors 1 to 4 carry where the uneven thrust is `uneven`: 1 and 4 are the
/// right pair.
std::array<double, 4> rotor_shares(double uneven);

}  // namespace tunnelrig
