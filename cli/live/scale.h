// From a channel's counts to what the page shows: newtons where there is a calibration, volts before.
#pragma once

#include "datasets/campaign.h"

#include <array>
#include <map>
#include <optional>
#include <string>

namespace tunnelrig::live {

/// A calibrated cell: thrust = (voltage − zero) · newtons_per_V, over the factor of its propeller already.
struct CalibratedCell {
  double newtons_per_V = 0;
  double zero_V = 0;  // the certificate's, where the session has no tare
};

/// What a campaign file knows of its cells; read by one thread, handed to others whole.
struct CellKnowledge {
  struct Tare {
    std::array<double, kMaxRotors> mean_V{};
    bool simulated = false;  // by a rig with a calendar of its own
    double end_s = 0;        // seconds since 1970, by the clock of the run's start
    double drift_V = 0;      // largest change of a channel against the session's tare before
    int drift_rotor = 0;     // 0: there was none before
  };
  std::optional<std::array<CalibratedCell, kMaxRotors>> cells;
  std::map<std::string, Tare> tares;  // the last complete one of each session
};

/// value = slope · counts + offset
struct Scale {
  bool newtons = false;
  std::array<double, kMaxRotors> slope{}, offset{};

  const char* unit() const { return newtons ? "N" : "V"; }
  double value(std::size_t channel, double counts) const { return slope[channel] * counts + offset[channel]; }
};

/// By the certificate and the session's last tare, as the reduction does it; the thrust of a propeller is
/// over its factor.
Scale scale_of(const CellKnowledge& knowledge, const CampaignInfo& info, const std::string& session);

}  // namespace tunnelrig::live
