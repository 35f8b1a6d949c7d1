// Air and speed as they were recorded, where the model takes a constant in their place.
#pragma once

#include "analysis/reduction.h"

#include <cstddef>
#include <string>
#include <vector>

namespace tunnelrig {

/// A condition that the model holds constant, and what C_T would change by if it entered as recorded.
struct UnusedCondition {
  std::string quantity;       // "pressure"
  std::string taken_for;      // "taken for 101325 Pa"
  std::string if_unrecorded;  // what of C_T nobody knows then
  std::string term;           // of `reduce --with`
  double mean = 0;            // as recorded, of the quantity itself
  std::string mean_text;      // with its unit
  std::size_t recorded = 0, runs = 0;
  double c_t_percent = 0;           // mean over the recorded runs
  std::string furthest;             // the location whose runs are furthest from that mean
  double furthest_c_t_percent = 0;  // theirs

  /// "1.20 % greater"
  static std::string change(double percent);
};

/// Those of `runs` (indices in CampaignData::runs) that neither a term nor an adopted effect takes in.
std::vector<UnusedCondition> unused_conditions(const CampaignData& data, const std::vector<std::size_t>& runs,
                                               const ModelTerms& terms = {}, const AppliedModel& model = {});

/// The same of the runs of a reduction, a sentence each; `u95_percent` is how well C_T is known by them.
std::vector<std::string> notes_of_unused_conditions(const CampaignData& data, const Reduction& reduction,
                                                    double u95_percent);

}  // namespace tunnelrig
