// Columns of the tunnel as curves with bars. Internal to analysis/report/figures.
#pragma once

#include "analysis/report/figures/figures.h"

#include <string>
#include <vector>

namespace tunnelrig::report {

constexpr double kPlotLeft_mm = 17.5, kPlotRight_mm = 2, kLegendLeft_mm = 8;
constexpr double kLeftTitle_mm = 14.8;  // of a plot with five digits at its axis
constexpr const char* kHeightTitle = "← ground    z̄ = 2z/(h_t − h_q) [–]    ceiling →";

/// Locations of one distance from the middle plane, from the ground upwards.
struct TunnelColumn {
  double y_norm = 0;
  std::string label;  // "H3, ȳ = 0.60", or without a name where it is not the thesis's
  std::vector<const LocationSummary*> locations;
};

/// From the middle outwards; they point into the summary.
std::vector<TunnelColumn> tunnel_columns(const Summary& summary);

/// x, mean, and half the length of its bar: a row of data.
std::vector<double> with_bar(double x, const LocationValue& value);

/// The curve of a block of such rows, as a part of `plot`, as its entry of the legend says.
std::string bar_curve(const std::string& block, const LegendEntry& look);

}  // namespace tunnelrig::report
