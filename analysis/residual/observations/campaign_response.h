// What a campaign's runs are explained by: their thrusts, volts, C_T, or a column of the sheet.
#pragma once

#include "analysis/reduction.h"
#include "analysis/residual/observations/observations.h"

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

namespace tunnelrig {

/// The runs that can be reduced, in the order of the rows.
struct CampaignSource {
  const CampaignData& data;
  const Reduction& reduction;
  std::vector<std::size_t> order;  // of reduction.runs, by time

  Eigen::Index rows() const { return static_cast<Eigen::Index>(order.size()); }
  const RunCoefficients& coefficients(Eigen::Index row) const {
    return reduction.runs[order[static_cast<std::size_t>(row)]];
  }
  const Run& run(Eigen::Index row) const { return data.runs[coefficients(row).run]; }
  const RunStatistics* statistics(Eigen::Index row) const {
    const auto found = data.statistics.find(run(row).run);
    return found == data.statistics.end() || found->second.frames == 0 ? nullptr : &found->second;
  }
};

/// By run and rotor; `known`: what the baseline makes of the air's density.
struct CampaignResponse {
  int channels = 1;
  std::string unit;
  std::function<double(Eigen::Index row, Eigen::Index channel)> value;
  std::function<double(double density_kg_m3, Eigen::Index channel)> known;
};

/// Throws InputError, when it is read, for a column that is none of numbers.
CampaignResponse response_of(const CampaignSource& source, const std::string& name,
                             const Eigen::VectorXd& newtons_per_volt);

/// A few runs below zero where all others pull are errors, and would make the whole model additive: they
/// leave the source, and `left_out` says so.
void leave_out_against_sign(CampaignSource& source, const CampaignResponse& response, Observations& result);

/// Value, unit, what is known of each run, and y.
void set_response(const CampaignSource& source, const CampaignResponse& response, Observations& result);

/// Rotors of which nothing can be seen: one that never changes, or all where each has a fixed share of a
/// total.
void warn_of_unmeasured_rotors(Observations& observations);

}  // namespace tunnelrig
