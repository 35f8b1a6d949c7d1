// The whole model at once: every adopted effect's parameters, refined together by Ceres.
#pragma once

#include "analysis/residual/likelihood/curves.h"
#include "analysis/residual/likelihood/held_out.h"

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace tunnelrig {

/// The mean model beyond the baseline: named terms with their parameters, and curves.
struct MeanModel {
  std::vector<Term> terms;
  std::vector<Curve> curves;

  MeanModel without_term(std::size_t t) const;
};

/// Where a parameter of the model stands.
struct ParameterPlace {
  std::size_t term = 0, parameter = 0;
  bool operator==(const ParameterPlace&) const = default;
};

/// A mean model at its parameters, ready for linear algebra: what the terms add, and columns for everything
/// still free.
struct LinearModel {
  Components offset;                // what the terms add to y
  std::vector<Components> columns;  // derivatives by the terms' free parameters, then the curves' columns
  std::vector<ParameterPlace> of_parameters = {};  // whose the first columns are

  /// Of a parameter; nothing where it has none: it is known, a change-point, or a shape at its bound.
  std::optional<Eigen::Index> column_of(const ParameterPlace& place) const;
  /// Leaves what the terms add: nothing is free any more.
  void clear_columns();
};

/// Forces (responses), n × c each.
struct Forces {
  /// Of baseline and terms: group constants and slopes fitted to some rows; with a linear baseline without
  /// its zero, which is no force. Effects of the run before are in what is fitted but not in here: it is
  /// loads that a cell remembers, not what it made of them.
  Eigen::MatrixXd predicted;
  /// By term: what it acts on, which is what those have made that act before it.
  std::vector<Eigen::MatrixXd> acted_on;
};
Forces predict_forces(const Observations& observations, const MeanModel& model, const std::vector<int>& rows);

/// The predicted ones alone.
Eigen::MatrixXd predict_response(const Observations& observations, const MeanModel& model,
                                 const std::vector<int>& rows);

/// y of the observations, as components.
Components response_components(const Observations& observations);
Components difference(const Components& a, const Components& b);

/// Which shapes of the terms have columns: one that has come to a bound is fitted by none.
enum class Shapes { kWithinBounds, kAll };
LinearModel linearise(const Observations& observations, const MeanModel& model, const Forces& forces,
                      Shapes shapes = Shapes::kWithinBounds);

struct JointFit {
  MeanModel model;
  LinearModel linear;
  NullFit variances;  // with the model in
  std::vector<ParameterPlace> at_bound;
  bool converged = true;
  bool settled = true;  // whether the last round of forces and parameters left both as they were
};

/// Whether parameter k is where physics ends.
bool is_at_bound(const Term& term, std::size_t k);

/// Whether a term's amplitude has come to the end of its physical bounds.
bool at_bound(const JointFit& fit, const Term& term);

/// Weighted by the variances of the mixed model, which are fitted anew after; group constants and curves are
/// linear and are projected out. Parameters stay within their physical bounds.
JointFit fit_jointly(const Observations& observations, const MeanModel& start, const std::vector<int>& rows);

/// The same with known variances, from a start that is nearly there: for jackknives. Nothing where it cannot
/// be fitted to these rows.
std::optional<MeanModel> refit(const Observations& observations, const MeanModel& start,
                               const NullFit& variances, const std::vector<int>& rows);

}  // namespace tunnelrig
