// Which controller of a flights.json is best, and what its runs cannot tell from that one. Internal to
// analysis/report.
//
// All controllers of a scenario fly the same runs: the same vehicles, sensors' errors and air. Errors are
// therefore compared run by run. What runs differ by is the same for both and drops out; the intervals of two
// means have it in them, and overlap long after the difference is plain.
#pragma once

#include "analysis/report/sections.h"

namespace tunnelrig::report {

/// Whether a flight of it was lost. Its errors are null then.
bool has_lost(const Json& controller);

/// P of Fisher's exact test, two-sided: that so many of the runs of two controllers touched a wall, or
/// numbers that are as unlikely, where both touch equally often.
double fisher_two_sided_p(int touched, int runs, int other_touched, int other_runs);

/// Where contacts are told apart, fewer are better; otherwise the smaller error is. `controllers` are objects
/// of flights.json; null where all of them lost a flight.
const Json* best_of(const std::vector<const Json*>& controllers);

/// Whether the runs leave open which of the two is better.
bool not_told_apart(const Json& one, const Json& other);

/// Says in the flight which controller is best, and in its controllers by how much they err more than that
/// one: 95 % interval of the mean difference between runs of the same number, Student's t.
void compare_with_best(Json& flight);

}  // namespace tunnelrig::report
