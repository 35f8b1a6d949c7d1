// Thrusts that no rotor of the rig's size and speed gives, or none beside the others: what a mistake of a
// unit or a sign makes of a campaign.
#pragma once

#include "analysis/campaign_data.h"
#include "analysis/reduction.h"
#include "analysis/table_reduction.h"

#include <optional>
#include <string>

namespace tunnelrig {

struct ImplausibleThrust {
  std::string found;   // place, value and rule
  std::string advice;  // what is likely wrong
  bool certain;        // a mistake; too little may be a rig at rest
};

/// Too much is said of any rotor at any location, by its mean thrust there. Too little is said only where
/// every rotor at every location has it: rotors may stand, or turn without blades. A sign is said to be wrong
/// where, in most runs, a rotor pulls backwards by more than a fifth of what another gives forwards.
std::optional<ImplausibleThrust> implausible_thrust(const CampaignData& data, const Reduction& reduction);

/// Of what the thesis's model makes of the campaign; nothing where it cannot be reduced.
std::optional<ImplausibleThrust> implausible_thrust(const CampaignData& data);

/// Too much by a group's median; too little by its largest C_T, since thrust vanishes at some advance ratio.
std::optional<ImplausibleThrust> implausible_thrust(const TableReduction& reduction);

}  // namespace tunnelrig
