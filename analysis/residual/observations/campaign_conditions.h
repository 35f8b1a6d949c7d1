// Conditions of a campaign's runs, and of the tares that their zeros are of.
#pragma once

#include "analysis/campaign_data.h"
#include "analysis/reduction.h"
#include "analysis/residual/observations/observations.h"

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tunnelrig {

/// A condition of a run; distances to ground and ceiling, if no column says them, by the label (GND1.25).
std::optional<double> condition(const Run& run, const std::string& name);

/// Of the lines of the mains, and of a shaft's that cannot be told from them.
double mains_amplitude_V(const ChannelStatistics& channel, const Daq& daq);

/// What the raw data show: amplitudes of lines and the share of clipped samples, by channel. `of_rows`: null
/// where a run has none.
void add_raw_conditions(const std::vector<const RunStatistics*>& of_rows, const Daq& daq,
                        Observations& observations);

/// Sets Covariate::at_zero of what effects of a zero follow, where runs have their zero by tares. `order`: of
/// reduction.runs, by row. A tare whose row of the sheet lacks a condition counts as having that of the run
/// of its session nearest in time, and `left_out` says so.
void set_conditions_at_zero(const CampaignData& data, const Reduction& reduction,
                            const std::vector<std::size_t>& order, Observations& observations);

}  // namespace tunnelrig
