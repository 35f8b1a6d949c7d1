// What an effect must be to be found.
#pragma once

#include "analysis/residual/search/found.h"
#include "analysis/residual/search/scan.h"

#include <map>
#include <string>

namespace tunnelrig {

struct Detectable {
  double largest = 0;                       // of all
  std::map<std::string, double> by_effect;  // by name
};

/// Rms, in y, at which an effect reaches the critical evidence in four of five data sets drawn from the null
/// model (the typical one of its forms and shapes): of what varies from session to session far more is needed
/// than of what varies from run to run. `scan`: of all effects, on top of no model. `otherwise`: the
/// largest, where none of them can be told.
Detectable detectable_by(const SearchData& data, const Found& found, const Scan& scan, double otherwise);

/// Where no candidate can be tried: rms, in y, of a single effect on all rotors alike that varies from run to
/// run, and would be found at 80 % power if it were the only candidate.
double detectable_by_one(const MixedModel& mixed, const NullFit& variances, double alpha);

}  // namespace tunnelrig
