// What the closed loop says of a campaign: the answer, and what it rests on.
#pragma once

#include "analysis/residual/explanation/seal.h"
#include "analysis/residual/likelihood/testability.h"
#include "analysis/residual/search/attribution.h"
#include "analysis/residual/search/group_amplitudes.h"
#include "analysis/residual/search/ways.h"

#include <map>
#include <optional>
#include <string>
#include <vector>

namespace tunnelrig {

struct ErrorEstimate {
  double rmse = 0;           // of the fitted runs
  double held_out_rmse = 0;  // of the sealed runs
  double held_out_low = 0, held_out_high = 0;
};

/// Errors of the sealed runs with parts of what was found: the names, the curves, both.
struct SealedErrors {
  double names = 0, curves = 0, all = 0;
  /// Whether they speak against the names beside the curves, and against what was adopted.
  bool against_names = false, against_adopted = false;
  /// Whether all that was found leaves more there than the scatter it expects, and chance, do.
  bool beyond_floor = false;
};

struct ParameterEstimate {
  std::string name, unit;
  double value = 0, low = 0, high = 0;  // 95 %; of a time constant or length within its physical bounds
  double standard_error = 0;            // where blocks give one
  std::vector<double> deviations;  // of the jackknife's folds: the covariance of two is their product's sum
  bool theory = false;             // the value is known physics; the interval is what the data say
  std::vector<GroupEstimate> groups;  // where each group has its own; value is their median then
  std::string run;                    // of a change-point: the first run (row) behind it
};

/// The run that would tell confounded effects apart.
struct SeparatingRun {
  std::map<std::string, double> setting;  // covariates to set
  std::string location;                   // empty: any
  double expected_sigma = 0;              // distance of the predictions over the scatter of a pair of runs
  std::string text;
};

struct AdoptedEffect {
  Term term;
  std::vector<ParameterEstimate> parameters;
  double p_value = 1;
  double held_out_gain = 0;  // unit of the response
  bool at_bound = false;     // of the amplitude, with the sealed runs in
  bool bends_away = false;   // likewise: what its covariate does is not its formula
  bool anywhere = false;     // of a step: its run's interval is most of the course
  std::vector<std::string> confounded_with;
  std::optional<SeparatingRun> separating_run;
};

struct ShapePoint {
  double x = 0, y = 0, low = 0, high = 0;  // y in the response's unit
};

struct UnknownStructure {
  std::string covariate;       // as runs.csv has it, or session, run_order, time_in_run
  std::string condition;       // the same as the observations have it: hours_in_session, hour_of_day
  std::string covariate_unit;  // empty: the name says it, or it is not known
  std::string place;           // what its slope goes with (Place); empty: alike everywhere
  std::string times;           // the other condition that its slope goes with; empty: none
  int rotor = -1;
  double p_value = 1;
  double amplitude = 0;        // half of peak to peak, unit of the response
  double beside_baseline = 0;  // what of it is left where the baseline has taken what it can make as well
  std::vector<ShapePoint> shape;
  bool levels = false;                      // the shape is one of few values, and nothing lies between them
  std::vector<std::string> labels;          // of a column of texts: x = i + 1 stands for labels[i]
  std::vector<std::string> instead_of;      // effects over this covariate that do not follow it
  bool by_sealed_too = false;               // the open blocks alone do not show it
  bool in_some_runs = false;                // found in those that have the condition
  std::vector<std::string> collinear_with;  // other conditions that it may be as well
  std::vector<CouldBe> could_be;  // names that go with it so nearly, or come so late, that none is given

  /// Whether it is a curve that the model can have, and errors can be given with.
  bool is_curve_of_model() const {
    return !by_sealed_too && !in_some_runs && !shape.empty() && covariate != "session";
  }
};

inline constexpr const char* kStructure = "structure";  // what has no name, over the column that is `missing`

struct Untestable {
  std::string effect, reason;
  std::vector<std::string> missing;
};

struct SuspectRow {
  std::string row;
  double studentised = 0;
  bool apart = false;      // far from all others, with a gap between (suspects.cpp)
  bool set_aside = false;  // the model is found without it
};

struct Explanation {
  std::string campaign, response, unit, baseline, verdict;
  /// " N", behind a number; nothing where the unit is 1 or not known.
  std::string unit_suffix() const { return unit.empty() || unit == "1" ? "" : " " + unit; }
  /// Of a response that is held on logarithms, its mean size: what curves say is a part of it, drawn in its
  /// unit. 0: not held like that.
  double relative_to = 0;
  double noise_floor = 0;
  int blocks = 0, runs = 0;
  int model_in_force = 0;  // version that reduce goes by, while `baseline` is the thesis's
  ErrorEstimate before, after;
  SealedErrors sealed;
  bool seal_chose = false;  // the sealed blocks had a part in what is adopted: their errors are no longer of
                            // what nobody has looked at
  std::vector<AdoptedEffect> adopted;
  std::vector<UnknownStructure> unknown;
  std::vector<Untestable> untestable;
  std::vector<SuspectRow> suspect_rows;
  std::vector<std::string> warnings;
  std::vector<std::string> empirical;  // curves that `after` has in it, because they were asked for
  double detectable = 0;               // at 80 % power, whichever effect it is
  std::map<std::string, double> detectable_by_effect;  // of each that was tried

  // what the pages show beside it
  std::vector<Round> rounds, curve_rounds;
  MeanModel model;                                  // fitted to all runs
  std::vector<Curve> by_sealed_too;                 // no part of `model`, since nothing is left to score them
  RunScatter scatter;                               // that they were found to have
  Eigen::MatrixXd residual_before, residual_after;  // n × c, unit of the response
};

/// The candidates as the data have them: in a table crosstalk from its other axes as well, and bounds that
/// hold for its response where those of volts or newtons do not. A campaign's are as they came.
class TableEffects {
 public:
  TableEffects(const Observations& observations, const std::vector<const Effect*>& effects);
  TableEffects(const TableEffects&) = delete;  // `all` points into it
  TableEffects& operator=(const TableEffects&) = delete;

  std::vector<const Effect*> all;

 private:
  std::vector<Effect> own_;
};

/// Whether an effect, in any of its ways, can be seen beside the baseline of these data, which must outlive
/// it.
class CanBeFound {
 public:
  explicit CanBeFound(const Observations& observations);
  CanBeFound(const CanBeFound&) = delete;  // its parts refer to each other
  CanBeFound& operator=(const CanBeFound&) = delete;
  Testability operator()(const Effect& effect) const;

 private:
  std::optional<Eigen::Index> undefined_in_all(const std::vector<Term>& ways) const;
  bool is_flat_at_zero(Term way) const;

  const Observations& observations_;
  std::vector<int> rows_;
  MixedModel baseline_;
  OwnEvidence has_evidence_;
};

/// The protocol: seal, search on the open runs, open the seal once, estimate on all.
Explanation explain(const Observations& observations, const std::vector<const Effect*>& effects,
                    const SearchSettings& settings);

/// The rows that the explanation's model and residuals are of, with the scatter that they were found to have.
Observations without_set_aside(const Observations& observations, const Explanation& explanation);

/// The unit of an effect's parameter k on these data: without a calibration there are no volts, and what
/// would be volts is in the response's unit.
std::string unit_of(const Observations& observations, const Effect& effect, std::size_t k);

/// The setting that tells the fit's term `t` from `rival` best, among conditions the rig has nearly seen.
std::optional<SeparatingRun> separating_run(const Observations& observations, const JointFit& fit,
                                            std::size_t t, const Term& rival, const std::vector<int>& rows);

}  // namespace tunnelrig
