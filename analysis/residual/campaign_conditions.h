// Conditions of a campaign's runs, and of the tares that their zeros are of.
#pragma once

#include "analysis/campaign_data.h"
#include "analysis/reduction.h"
#include "analysis/residual/observations.h"

#include <optional>
#include <string>
#include <vector>

namespace tunnelrig {

/// A condition of a run; distances to ground and ceiling, if no column says them, by the label (GND1.25).
std::optional<double> condition(const Run& run, const std::string& name);

/// Of a channel's lines at the mains' frequency and its harmonics together.
double mains_amplitude_V(const ChannelStatistics& channel);

/// Sets Covariate::at_zero of what effects of a zero follow, where runs have their zero by tares. `order`: of
/// reduction.runs, by row. A tare whose row of the sheet lacks a condition counts as having that of the run
/// of its session nearest in time, and `left_out` says so.
void set_conditions_at_zero(const CampaignData& data, const Reduction& reduction,
                            const std::vector<std::size_t>& order, Observations& observations);

}  // namespace tunnelrig
