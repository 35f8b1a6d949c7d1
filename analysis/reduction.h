// Runs to coefficients: calibrated thrusts, C_T and U of each run, with what they depend on.
#pragma once

#include "analysis/campaign_data.h"
#include "calibration/tare.h"

#include <array>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

namespace tunnelrig {

/// Measured conditions that enter the model beyond the thesis's: each only where it is switched on by name.
struct ModelTerms {
  bool air_pressure = false;  // ρ at the measured pressure, not at 101325 Pa
  bool air_humidity = false;  // ρ of moist air
  bool rotor_speed = false;   // Ω as the tachometer read it, not nominal

  /// "thesis" or the names of the terms, "air_pressure+rotor_speed".
  std::string name() const;
};

/// Reads "air_pressure,air_humidity,rotor_speed" in any order, or "thesis"; throws InputError.
ModelTerms terms_from_names(std::string_view names);

/// One thrust run, reduced.
struct RunCoefficients {
  std::size_t run = 0;                        // index in CampaignData::runs
  std::array<double, kMaxRotors> thrust_N{};  // calibrated, over the propeller's factor
  double total_N = 0;
  double c_t = 0;        // (4.18)
  double u_percent = 0;  // (5.1); NaN for fewer than four rotors
  double density_kg_m3 = 0;
  double speed_rpm = 0;
  double temperature_K = 0;
  double c_t_standard_error = 0;  // of the run's noise alone
  double u_standard_error = 0;
  std::array<double, kMaxRotors> thrust_standard_error_N{};  // likewise

  // how each corrected thrust depends on what is shared between runs
  std::array<double, kMaxRotors> d_zero_N_per_V{}, d_gain_N2_per_V{}, d_tare_N_per_V{};
  std::vector<std::array<double, kMaxRotors>> d_parameter_N;  // by the adopted model's parameters
  std::optional<TareZero> tare;

  bool from_volts = false;  // else from the sheet, as they are there
  bool zero_from_calibration = false;
  bool extrapolated = false;
  bool stationary = true;
  std::uint64_t clipped = 0;  // samples
};

struct LeftOutRun {
  std::string run, reason;
  bool problem = true;  // false: nothing that needs mending (excluded, a partial recording)
};

/// The version of the model that the thrusts were corrected by; version 0 is the thesis's, without
/// correction.
struct AppliedModel {
  int version = 0;
  std::vector<std::string> effects;  // in words
  Eigen::MatrixXd covariance;        // of its parameters
  double dof = std::numeric_limits<double>::infinity();
  double pressure_exponent = 0;                // C_T is corrected by p to this power
  std::vector<std::string> effect_names = {};  // "air_pressure"
};

struct Reduction {
  ModelTerms terms;
  AppliedModel model;
  std::vector<RunCoefficients> runs;
  std::vector<LeftOutRun> left_out;
  Tares tares{{}};

  /// "thesis", "air_pressure+rotor_speed", or "version 2 (creep of rotor 1)".
  std::string model_name() const;
};

/// Reduces every thrust run that can be; the others are left out by name, and so are tares that cannot be
/// zeros. Throws InputError where no run can be, where raw runs have no calibration, and where a switched-on
/// term lacks its measurement in some run.
Reduction reduce_runs(const CampaignData& data, const ModelTerms& terms);

/// Indices in CampaignData::runs of those of a kind whose means can be used: recorded whole, not excluded,
/// with statistics of these raw data and no channel stuck. Tares among them serve as such: the motors are
/// stopped.
std::vector<std::size_t> recorded_runs(const CampaignData& data, RunKind kind);

/// The readings of the tares in the same order, each at its middle.
Tares tares_of(const CampaignData& data);

/// Total, C_T and U with their errors, from the thrusts.
void set_coefficients(const CampaignInfo& info, RunCoefficients& run);

/// ∂C_T/∂T_i and ∂U/∂T_i of a run.
std::array<double, kMaxRotors> c_t_per_thrust(const RunCoefficients& run, const Rig& rig);
std::array<double, kMaxRotors> u_per_thrust(const RunCoefficients& run);

}  // namespace tunnelrig
