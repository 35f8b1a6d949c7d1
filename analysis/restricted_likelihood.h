// The likelihood that variance components are fitted by, and what it sees of the runs.
#pragma once

#include "analysis/variance_components.h"

#include <cstddef>
#include <vector>

namespace tunnelrig {

/// What one location saw of one session.
struct LocationVisit {
  std::size_t location = 0, session = 0;
  double runs = 0, mean = 0, squares = 0;  // squares: around the visit's mean
};

/// Locations and sessions are indices from 0.
struct VisitDesign {
  std::vector<LocationVisit> visits;
  std::size_t locations = 0, sessions = 0;
};

/// What a visit's mean varies by without the visit and session components.
double own_variance(const LocationVisit& visit, const VarianceComponents& components);

/// Restricted log-likelihood of the visits' means, locations fixed, at variances of visit and session. Made
/// once for many of them; design and components must outlive it.
class RestrictedLikelihood {
 public:
  RestrictedLikelihood(const VisitDesign& design, const VarianceComponents& components);
  double operator()(double visit, double session) const;

 private:
  const VisitDesign& design_;
  const VarianceComponents& components_;
  std::vector<LocationVisit>
      by_session_;  // of few locations and many sessions: the visits, session by session
};

}  // namespace tunnelrig
