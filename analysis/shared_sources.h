// The errors that locations share: of the cells, propellers, tares, instruments and the adopted model.
#pragma once

#include "analysis/location_summary.h"

#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace tunnelrig {

/// An error that several locations share: parameters with a covariance, and how each location depends on
/// them.
struct SharedSource {
  double Budget::*share;
  Eigen::MatrixXd covariance;  // of the parameters
  double dof;
  Eigen::MatrixXd c_t, u;  // locations × parameters

  bool has_dof() const { return std::isfinite(dof) && dof > 0; }
};

/// All sources that the campaign declares or its certificate, tares and model know. `location_of` has the
/// location of each of the reduction's runs, `c_t` the mean C_T of each location; `notes` is told what is
/// left out.
std::vector<SharedSource> shared_sources(const CampaignData& data, const Reduction& reduction,
                                         const std::vector<std::size_t>& location_of,
                                         const std::vector<double>& c_t, std::vector<std::string>& notes);

}  // namespace tunnelrig
