// What each mounted propeller lifts, against the four together (thesis 4.2.1.1, docs/campaign-folder.md).
#pragma once

#include "datasets/campaign.h"

#include <string>
#include <vector>

#include <Eigen/Core>

namespace tunnelrig {

/// Corrected thrust of rotor i is T_i / factor[i − 1].
struct PropellerFactors {
  bool tested = false;         // without tests every factor is 1 exactly
  Eigen::VectorXd factor;      // k_i, one per rotor; they average 1
  Eigen::MatrixXd covariance;  // of the factors; singular, because their mean is fixed
  int dof = 0;                 // of the pooled scatter; 0: no repeats, covariance 0, uncertainty left out
  double scatter_N = 0;        // standard deviation of one thrust measurement
  std::vector<std::string> propellers;  // by rotor
  std::vector<int> repeats;             // by rotor

  bool uncertainty_known() const { return !tested || dof > 0; }
};

/// k_i = m_i / mean(m), m_i the mean thrust of the propeller on rotor i. The repeats of all propellers are
/// taken to scatter alike (one stand, one motor, thrusts within 8 %), so that one with a single test has an
/// uncertainty too: var m_i = scatter² / repeats_i, and the factors' covariance by the delta method with
/// ∂k_i/∂m_j = (δ_ij − k_i / rotors) / mean(m).
/// Throws InputError naming lines for a rotor with two propellers, a propeller on two rotors or turning both
/// ways, a rotor without test where others have one, and a thrust that is not above 0.
PropellerFactors propeller_factors(const std::vector<PropellerTest>& tests, int rotors);

}  // namespace tunnelrig
