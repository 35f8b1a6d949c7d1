// A reduction as the files that people and programs read.
#pragma once

#include "analysis/conventions.h"
#include "analysis/location_summary.h"
#include "analysis/maps/map_input.h"

#include <string>
#include <vector>

namespace tunnelrig {

/// One row per location, open space included:
/// location,y_norm,z_norm,runs,c_t,c_t_std,c_t_u95,u_percent,u_percent_std, u_percent_u95, then sessions,
/// thrust, rotors, degrees of freedom, the budget, convention, model and what U95 is without. Empty cells are
/// not known.
std::string locations_csv(const Summary& summary, const Reduction& reduction, const Rig& rig,
                          Convention convention);

/// One row per reduced run.
std::string runs_csv(const CampaignData& data, const Reduction& reduction, Convention convention);

/// Both, with what was left out and why: docs/reduction.md.
std::string reduction_json(const CampaignData& data, const Reduction& reduction, const Summary& summary,
                           Convention convention);

/// The tunnel locations as a map takes them. Throws InputError for a campaign without tunnel or without four
/// rotors.
MapInput map_input(const CampaignData& data, const Summary& summary, const std::string& source);

/// Labels of the locations that a map leaves out although they are not in open space (a label of it, or a
/// distance to ground or ceiling): their labels are not of the tunnel's grid, and their runs have no y_norm
/// and z_norm.
std::vector<std::string> not_on_the_map(const CampaignData& data, const Summary& summary);

}  // namespace tunnelrig
