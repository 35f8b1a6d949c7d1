// The calibration certificate: everything that turns a rig's volts into newtons, what it was made from, and
// whether it can be trusted.
#pragma once

#include "calibration/load_cell.h"
#include "calibration/propellers.h"
#include "datasets/campaign.h"
#include "datasets/thesis.h"

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tunnelrig {

/// What a cell must pass. Lack of fit, the quadratic term and hysteresis fail a cell that shows them both
/// beyond doubt (test_p) and larger than matters (effect_percent_of_span).
struct CalibrationLimits {
  double correlation = thesis::kCorrelationGate;  // its magnitude is above
  double test_p = 0.0005;
  double effect_percent_of_span = 0.1;  // largest deviation, the quadratic term's bow, hysteresis
  double residual_percent_of_span = 2;  // residual standard deviation
  double change_percent_of_span = 0.5;  // zero return, creep
  double force_u95_percent = 1;  // of the largest force, at the middle of the range, from the line alone
};

struct CalibrationOptions {
  int rotors = kMaxRotors;
  LoadCellOptions cell;
  CalibrationLimits limits;
};

struct CalibrationGate {
  int cell = 1;
  std::string name;  // "correlation", "lack of fit", …
  bool passed = true;
  std::string finding;  // what was found and the limit, in words
};

struct CalibrationConditions {
  int points = 0;
  int propeller_tests = 0;
  std::optional<double> lowest_air_temperature_C, highest_air_temperature_C;
};

/// A force and what it depends on, for the propagation of errors. The errors of zero and gain are shared by
/// all forces of a cell: their covariance is CellFit::covariance.
struct ForceReading {
  double force_N = 0;
  double d_voltage_N_per_V = 0;
  double d_tare_N_per_V = 0;  // 0 without tare
  double d_zero_N_per_V = 0;  // of the calibration's zero; 0 with a tare
  double d_gain_N2_per_V = 0;
  bool zero_from_calibration = false;  // no tare: the zero is an extrapolation of the calibration's line
  bool extrapolated = false;           // outside the forces that the cell was calibrated with
};

struct Certificate {
  CalibrationConditions conditions;
  std::vector<CellFit> cells;  // of rotor 1, 2, …
  PropellerFactors propellers;
  std::vector<CalibrationGate> gates;
  std::vector<std::string> warnings;  // in plain words
  std::string points_hash;            // of the points and tests that it was made from

  bool passed() const;  // all gates

  /// (voltage − zero) / gain of cell 1 to `cells`, the zero being the tare's, or the calibration's without
  /// one. Not corrected for the propeller.
  ForceReading force(int cell, double voltage_V, std::optional<double> tare_V = {}) const;
};

/// Fits all cells and propellers. Throws InputError where fit_load_cell or propeller_factors does, and for a
/// cell without points.
Certificate calibrate(const std::vector<CalibrationPoint>& points, const std::vector<PropellerTest>& tests,
                      const CalibrationOptions& options = {});

/// Hash of what a certificate is made from, "xxh3:…": equal points and tests in equal order have equal
/// hashes.
std::string hash_of(const std::vector<CalibrationPoint>& points, const std::vector<PropellerTest>& tests);

/// JSON that certificate_from_json gives every field back from, bit by bit; `indent` as nlohmann's dump.
std::string to_json(const Certificate& certificate, int indent = -1);

/// Throws InputError where the text is no certificate of this version.
Certificate certificate_from_json(std::string_view json);

/// The certificate as a page of text, to be printed and filed.
std::string format_certificate(const Certificate& certificate);

}  // namespace tunnelrig
