// Locations: means over runs, and a budget of their uncertainty (GUM) that keeps what locations share as
// shared.
#pragma once

#include "analysis/reduction.h"

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace tunnelrig {

/// One quantity (C_T, U) at one location.
struct LocationValue {
  double mean = 0;
  double std = 0;                   // over the runs; NaN for a single one
  double standard_uncertainty = 0;  // NaN, and u95 as well, where nothing tells how runs scatter
  double dof = 0;                   // effective, Welch–Satterthwaite
  double u95 = 0;                   // expanded: Student's t at 95 %
};

/// Standard uncertainties of C_T at a location by source, absolute.
struct Budget {
  double run = 0;          // repeatability, over the number of runs
  double visit = 0;        // coming back to the location
  double session = 0;      // from one set-up of the rig to the next
  double calibration = 0;  // of the cells; shared between locations
  double propellers = 0;   // shared
  double tare = 0;         // shared by the runs of a session
  double speed = 0;        // of the tachometer; shared
  double temperature = 0;  // of the thermometer; shared
  double pressure = 0;     // of the barometer, where it enters the model; shared
  double model = 0;        // of the adopted effects' parameters; shared
};

struct LocationSummary {
  std::string label;  // OT for H0V0
  std::optional<double> y_norm, z_norm;
  int runs = 0, sessions = 0;
  LocationValue c_t, u_percent;
  std::vector<double> c_rotor;  // C_T of each rotor alone, over one disc: they add up to the mean C_T
  double thrust_N = 0;          // mean total
  Budget budget;
};

struct Summary {
  std::vector<LocationSummary> locations;  // tunnel first, column by column
  Eigen::MatrixXd c_t_covariance;          // between locations, all sources
  Eigen::MatrixXd u_covariance;
  /// For Welch and Satterthwaite: the covariance of each source of finite degrees of freedom ν, over √ν. A
  /// sum over locations with weights w and variance u² has ν = u⁴ / Σ (wᵀ S w)².
  std::vector<Eigen::MatrixXd> c_t_over_root_dof, u_over_root_dof;
  std::vector<std::string> notes;  // what was left out of the budget, and why
  /// "repeats", "sessions": scatter that the campaign does not show. What stands as U95 is without it, and
  /// holds the truth in less than 95 %.
  std::vector<std::string> u95_without;
};

/// Throws InputError where one label stands at two places.
Summary summarize_locations(const CampaignData& data, const Reduction& reduction);

}  // namespace tunnelrig
