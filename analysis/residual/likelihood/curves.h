// Structure without a name: smooth dependence of the residual on a covariate, on the order of runs, on time
// within them.
#pragma once

#include "analysis/residual/likelihood/curve_basis.h"
#include "analysis/residual/likelihood/likelihood.h"

#include <optional>
#include <string>
#include <vector>

namespace tunnelrig {

/// A curve over one covariate, of all rotors alike or of one. It describes; it never names a cause.
struct Curve {
  std::string
      covariate;  // a column of the sheet, or "run_order", "time_in_run", "hours_in_session", "hour_of_day"
  int rotor = -1;
  CurveShape shape = CurveShape::kWaves;
  std::vector<Components> columns;
  std::vector<double> tilt = {};          // of each column: what was taken out of it of s; empty: nothing
  Eigen::MatrixXd x;                      // n × 1 or n × c: what it is drawn against; empty for time_in_run
  double low = 0, high = 1;               // of x, among the rows that decided how many bends there are
  std::vector<double> levels = {};        // of kLevels: the values told apart, the most common first
  std::vector<std::string> labels = {};   // of texts: value i + 1 stands for labels[i]
  Place place = {};                       // what it is drawn for is a weight of 1
  std::optional<Strength> strength = {};  // where it goes with another condition, which `place` names then

  std::string label() const;
  bool everywhere() const { return place.name.empty(); }
  /// Where it goes with a place, or with another condition; empty elsewhere.
  std::string in_place() const { return strength ? "" : place.name; }
  std::string times() const { return strength ? place.name : ""; }
  /// Whether it is over the same, of the same rotor and in the same places.
  bool is_like(const Curve& other) const;
};

/// Curves over everything that is known of the runs: a bend beside whatever trend has a name, waves, and
/// where there are few values (always with texts) a constant for each; straight lines whose slope goes with
/// the place in the tunnel, or with another condition. `rows` decide how many bends a covariate can show: one
/// for every three different values, at most six.
std::vector<Curve> curves_to_try(const Observations& observations, const std::vector<int>& rows);

/// The same without what is straight: beside a named effect of the same covariate, whose work that is.
Curve without_trend(const Curve& curve, const std::vector<int>& rows);

/// A curve without its straight part that has to do all of the covariate's work: the same with it.
Curve with_trend(const Curve& curve);

/// What waves or a bend have found, as a smooth curve of 1, 2 … columns, as many as its covariate can show.
/// Empty for others, and for bends beside a name.
std::vector<Curve> smooth_forms(const Observations& observations, const Curve& curve,
                                const std::vector<int>& rows);

/// A condition as the curve's s is straight in it: itself, or its logarithm.
Covariate as_measured_along(const Covariate& covariate, CurveShape shape);

/// Whether one of these covariates is what the curve is over.
bool is_over(const Curve& curve, const std::vector<std::string>& covariates);

/// Whether the curve is a single bend over a covariate of these, of this rotor (−1: all).
bool is_bend_over(const Curve& curve, const std::vector<std::string>& covariates, int rotor);

Candidate as_candidate(const Curve& curve);

}  // namespace tunnelrig
