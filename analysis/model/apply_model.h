// A version of the model at work: readings are led back to what the baseline speaks of.
#pragma once

#include "analysis/model/model_version.h"
#include "analysis/reduction.h"

namespace tunnelrig {

/// `thesis`, reduced without terms, with every thrust T replaced by the force F of which the model says that
/// it reads T: T = e(F), to 1e-10 of T. An effect that changes within a run is averaged over the run. A run
/// that lacks a covariate which an adopted effect needs is left out with the reason. Throws InputError where
/// no run remains, and where the model names a rotor that the rig does not have.
Reduction apply_model(const CampaignData& data, const Reduction& thesis, const ModelVersion& model);

}  // namespace tunnelrig
