// All effects, in all their ways, that may be put on top of a model.
#pragma once

#include "analysis/residual/search/found.h"
#include "analysis/residual/search/scan.h"

namespace tunnelrig {

/// Prior weight of an effect whose amplitude is each group's own: as for one rotor alone.
inline constexpr double kWeightInGroups = 0.25;

/// Whether a model has the effect, or another form of it, of a way's rotor.
bool already_in(const Term& way, const MeanModel& model, Eigen::Index channels);

/// But for what the model has, what a found curve does, and what was beyond its bounds; with one amplitude
/// for all groups.
Scan scan_effects(const SearchData& data, const Found& found, const JointFit& base);

/// On top of the model so far, also with an amplitude of each group's own, and several at once.
Scan scan_effects_and_groups(const SearchData& data, const Found& found);

}  // namespace tunnelrig
