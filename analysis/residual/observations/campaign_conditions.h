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

/// Of those of a channel's lines together whose name `chosen` accepts.
double amplitude_of_lines_V(const ChannelStatistics& channel, bool (*chosen)(std::string_view name));

/// Sets Covariate::at_zero of what effects of a zero follow, where runs have their zero by tares. `order`: of
/// reduction.runs, by row. A tare whose row of the sheet lacks a condition counts as having that of the run
/// of its session nearest in time, and `left_out` says so.
void set_conditions_at_zero(const CampaignData& data, const Reduction& reduction,
                            const std::vector<std::size_t>& order, Observations& observations);

}  // namespace tunnelrig
