// A rig that is not there: simulated load cells, amplifiers, converter, propellers, weather and tunnel behind
// the real packet format. Everything it does is a function of the seed and of what is asked, so any run can
// be made again.
//
// It is simulated, and it knows nothing of how it will be analysed; the analysis knows nothing of it.
#pragma once

#include "daq/faults.h"
#include "daq/packet_source.h"
#include "datasets/campaign.h"

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace tunnelrig {

struct VirtualRigSettings {
  std::uint64_t seed = 1;

  // scatter, standard deviations
  double thrust_run = 0.0026;      // all rotors of a run alike: with the speed, σ(C_T) = 3.5e-4 at 0.1056
  double thrust_rotor = 0.0015;    // each rotor of a run by itself
  double thrust_session = 0.0010;  // all runs of a session alike
  double speed_run_rpm = 5.0;      // how well the speed is set
  double tachometer_rpm = 1.0;     // how well it is read
  double zero_session_V = 0.002;   // amplifier zero from day to day
  double zero_drift_V_h = 0.001;   // and within a day
  double thermometer_K = 0.1;
  double gauge_N = 0.02;               // force gauge at the calibration bench
  double propeller_direction = 0.015;  // half the difference between CW and CCW propellers
  double propeller_within = 0.005;

  // signal
  double vibration_shaft_N = 0.35;
  double vibration_blade_N = 0.15;
  double turbulence = 0.012;  // of the thrust, correlated over turbulence_s
  double turbulence_s = 0.08;
  double amplifier_noise_V = 0.0015;
};

struct VirtualRunRequest {
  std::string session;
  std::string location;
  int repeat = 1;
  RunKind kind = RunKind::kThrust;
  double start_s = 0;  // seconds since 1970
  double session_start_s = 0;
  double duration_s = 60;
  double speed_rpm = 5000;  // what the operator sets
};

/// What the instruments beside the board showed during a run.
struct InstrumentReadings {
  double speed_rpm = 0;  // 0 with the motors stopped
  double air_temperature_C = 0;
  double air_pressure_Pa = 0;
  double relative_humidity = 0;
  double supply_voltage_V = 0;
};

class VirtualRig {
 public:
  VirtualRig(const CampaignInfo& campaign, const VirtualRigSettings& settings);

  /// Ten random forces of 4.9 to 9.8 N per cell by a force gauge: calibration.csv.
  Sheet calibration_bench() const;

  /// Each mounted propeller tested four times on the same motor: propellers.csv.
  Sheet propeller_bench() const;

  InstrumentReadings readings(const VirtualRunRequest& run) const;

  /// The board during the run, and for as long after as one reads. `pace` 1 is real time, 0 as fast as one
  /// reads. Throws InputError for a location that the rig cannot go to.
  std::unique_ptr<PacketSource> board(const VirtualRunRequest& run, double pace, const Faults& faults) const;

 private:
  struct Cell {
    double zero_V = 0, gain_V_per_N = 0;
  };

  CampaignInfo campaign_;
  VirtualRigSettings settings_;
  std::array<Cell, kMaxRotors> cells_;
  std::array<double, kMaxRotors> propeller_factor_;
};

}  // namespace tunnelrig
