// Hyperparameters of the Gaussian process by maximum marginal likelihood.
#pragma once

#include "analysis/maps/field_data.h"
#include "analysis/maps/gaussian_process.h"

namespace tunnelrig {

/// Log-normal priors, weak: two standard deviations of a length are a factor of five. They matter where few
/// locations leave the likelihood flat.
struct HyperparameterPriors {
  double length = 0.8;  // median correlation length, normalised: a rotor diameter, in the thesis's tunnel
  double length_log_std = 0.8;
  double amplitude_log_std = 1.5;  // about the rms of the values
  double excess_log_std = 1.5;     // about the scatter that the measured covariance makes between locations
};

/// The most probable hyperparameters. Deterministic: the best of a fixed set of starts.
Hyperparameters fit_hyperparameters(const FieldData& data, const HyperparameterPriors& priors = {});

}  // namespace tunnelrig
