// Parts of an explanation, in the order in which explain() puts them together.
#pragma once

#include "analysis/residual/explanation/explanation.h"
#include "analysis/residual/explanation/seal.h"

namespace tunnelrig {

// --- protocol.cpp

/// The protocol, once, on all rows.
Explanation explain_once(const Observations& observations, const std::vector<const Effect*>& effects,
                         const SearchSettings& settings);

/// By what is adopted and unknown, where there were blocks enough.
std::string verdict_of(const Explanation& explanation);

// --- estimate_on_all.cpp

/// A model with the scatter that its fit to the open runs allows for.
struct Fitted {
  Observations data;
  JointFit fit;
};

/// What is held against what: the data with what the search gave groups of their own, and without.
struct Models {
  const Observations& wide;
  const Observations& alone;
  const Fitted& baseline;
  const Attribution& found;
};

/// Parameters with their intervals, structure that the open runs were too few to show, rows that are off, and
/// what speaks against any of it.
void estimate_on_all(const Models& models, const Observations& observations,
                     const std::vector<const Effect*>& effects, const SearchSettings& settings,
                     Explanation& explanation);

// --- conditions.cpp

/// Effects that cannot be tried and why; conditions that nothing can be found to follow, because they never
/// changed or the baseline takes it; pairs of covariates that no campaign of this design can tell apart.
void report_untestable(const Observations& observations, const std::vector<const Effect*>& effects,
                       const std::vector<int>& rows, Explanation& explanation);

// --- unseen_conditions.cpp

inline constexpr double kCollinear = 0.999;  // correlation

/// Conditions that are the same in every run, missing in some or collinear with another: warnings, and
/// entries of what is untestable.
void report_unseen_conditions(const Observations& observations, const std::vector<const Effect*>& effects,
                              const std::vector<int>& rows, Explanation& explanation);

/// Other conditions that go with this one so nearly that what is said of it may be theirs.
std::vector<std::string> collinear_with(const Observations& observations, const Covariate& covariate);

// --- conditions.cpp

/// Conditions that change once and for all where an adopted step may be: another battery, other blades.
void warn_of_changes_at_steps(const Observations& observations, Explanation& explanation);

/// What the search found of the runs' scatter and allowed for: a rotor with more of it, neighbours that
/// resemble each other.
void warn_of_scatter(const Observations& observations, Explanation& explanation);

// --- doubts.cpp

/// Candidates that would be named, were it not for their physical bounds.
void warn_of_bounds(const Observations& observations, const Attribution& found, Explanation& explanation);

/// Of two errors of the sealed blocks: by more than chance may do.
inline bool is_worse(double error, double than) { return error > 1.1 * than; }

/// What the opened seal and the intervals say against what was adopted.
void warn_of_doubts(Explanation& explanation);

/// Effects of the measured speed that take back a part of its square: noise of the reading does that as well,
/// and where it would be no more than tachometers have, the two are not to be told apart.
void warn_of_noisy_speed(const Observations& observations, const Eigen::MatrixXd& predicted,
                         Explanation& explanation);

/// Effects and curves whose amplitude within blocks is another than from one block to the next.
void warn_of_blocks_of_their_own(const Observations& observations, const JointFit& fit,
                                 const std::vector<int>& rows, Explanation& explanation);

/// Conditions that none of the candidates follows, and that go with an adopted effect so nearly that its
/// size, by its own error, does not tell the two.
void warn_of_companions(const Observations& observations, const std::vector<const Effect*>& effects,
                        Explanation& explanation);

/// Constants of a table's thrusts beside their C_T, where the baseline has them.
void warn_of_tares(const Observations& observations, const MeanModel& model, Explanation& explanation);

/// What the campaign, or the table, calls a block.
std::string block_noun(const Observations& observations);

/// Blocks that alone show a structure, of which nothing else is reported.
void warn_of_single_blocks(const Observations& observations, const std::vector<OfOneBlock>& found,
                           Explanation& explanation);

/// Blocks that are far from what the others lead to expect, all rotors or one against the rest: a bad day.
void warn_of_odd_blocks(const Observations& observations, Explanation& explanation);

/// Rows that stand for themselves, but resemble the row before them in what the model leaves.
void warn_of_alike_rows(const Observations& observations, Explanation& explanation);

// --- taken_back.cpp

/// What all runs say against a name that the open ones had let in; empty: nothing. Theory's coefficient is
/// not the data's to refute.
std::string refutation(const AdoptedEffect& adopted, const Observations& observations);

/// Once more without the names that are refuted: what they did may be structure whose cause is not known.
/// Where the names predict the sealed blocks, and what is found without them does not, they stay; so does the
/// first of names that took each other's place and are all refuted like that. What may not be found any more
/// is out of `effects` and `settings` then.
Explanation without_refuted(Explanation explanation, const Observations& observations,
                            std::vector<const Effect*>& effects, SearchSettings& settings,
                            std::vector<std::string>& said);

// --- incomplete_conditions.cpp

/// Holds what was found, or nothing, against the runs that have conditions of which others lack a value. What
/// goes with such a condition there is unknown structure, since no name of it can be held against all runs;
/// names that these runs do not confirm are taken back; and it is `said`.
Explanation without_names_of_incomplete(Explanation explanation, const Observations& observations,
                                        const std::vector<const Effect*>& effects,
                                        const SearchSettings& settings, std::vector<std::string>& said);

// --- change_points.cpp

/// Where a parameter may lie as well that no jackknife moves, as far as all runs tell: the run of a step, a
/// time constant beside amplitudes of the groups' own.
struct Profiled {
  std::size_t term, parameter;
  double low, high;  // 95 %
};

/// Steps were sought by the open blocks; all runs tell where they lie. The columns of those with amplitudes
/// of the groups' own are made anew there.
MeanModel with_change_points_of_all(Observations& observations, MeanModel model,
                                    std::vector<Profiled>& result);

/// The same for the shapes of effects with amplitudes of the groups' own.
MeanModel with_group_shapes_of_all(Observations& observations, MeanModel model,
                                   std::vector<Profiled>& result);

/// Sealed runs between the open ones on either side of a step, before or behind it: the open ones do not say
/// which, so no model could predict them. Nothing where all are.
std::vector<int> astride_of_steps(const MeanModel& model, const Seal& seal);

// --- estimates.cpp

/// Root mean square of the sealed runs and its 95 % interval: blocks are resampled, Student's t for their
/// number, on the logarithm. `open`: errors of the open blocks, each predicted from the others, which say how
/// blocks differ as well; empty where there are none.
void set_interval(const Observations& observations, const HeldOutErrors& sealed, const HeldOutErrors& open,
                  std::uint64_t seed, ErrorEstimate& estimate);

/// Jackknife over blocks: value and 95 % interval of every parameter of every term.
std::vector<std::vector<ParameterEstimate>> estimate_parameters(const Observations& observations,
                                                                const JointFit& fit,
                                                                const std::vector<int>& rows);

/// The groups' median and its interval; of few groups what holds all of their intervals.
ParameterEstimate summary_of_groups(const EffectParameter& parameter, std::vector<GroupEstimate> groups);

// --- describe.cpp

/// The curve over its covariate, in the response's unit, with a 95 % band.
UnknownStructure describe(const Observations& observations, const JointFit& fit, const FoundCurve& found,
                          const std::vector<int>& rows);

/// Session scatter that no covariate explains: the sessions' offsets themselves are the shape. Of a rotor;
/// −1: of the rotors' mean.
UnknownStructure describe_sessions(const Observations& observations, const Eigen::MatrixXd& residual,
                                   const SessionScatter& scatter, const std::vector<int>& rows);

// --- suspects.cpp

double degrees_of_freedom(const Observations& observations, const JointFit& fit,
                          const std::vector<int>& rows);

/// Of a normal distribution, by sizes of deviations from medians that a few gross ones may be among. The run
/// that is the median of its location deviates by 0, and so does one that stands alone: they say nothing of
/// it. 0 where none says anything.
double sigma_by_median(const Eigen::VectorXd& sizes);

/// Where a row stands among those of the observations.
int place_of(const Observations& observations, const std::string& row);

/// Rows whose externally studentised residual is beyond what n normal ones reach once in a hundred data sets.
/// `errors` are of the fitted rows: their variance is σ²(1 − h), where expected_std has σ²(1 + h).
std::vector<SuspectRow> suspect_rows(const Observations& observations, const HeldOutErrors& errors,
                                     const NullFit& variances, double dof);

/// Whether a row lies where a curve of the model has not been: it stays there as it was at its end, and
/// nothing says that it is the row that is wrong.
bool is_beyond_a_curve(const MeanModel& model, int row);

/// Rows that were held out, and are far from what was predicted for them while the rest of their block is
/// not, in σ by the median: a fit with them in bends to them. Of predictions beyond what a table holds out by
/// name, or of blocks of one row, nothing says that it is the row that is wrong.
std::vector<SuspectRow> apart_from_their_block(const Observations& observations, const MeanModel& model,
                                               const HeldOutErrors& sealed);

/// Blocks of a table that the baseline leaves far from all others, in words: their unit may be another.
std::vector<std::string> blocks_apart(const Observations& observations);

/// The one row of a table that the baseline alone leaves far from all others (apart as above). At the end of
/// a condition a curve would pass through it, and nothing be far from that.
std::optional<SuspectRow> lone_row(const Observations& observations);

/// The worst row of a table whose rows stand for themselves, if it is beyond doubt with all that the other
/// axes can explain in the model.
std::optional<SuspectRow> gross_row(const Observations& observations);

/// Runs of a campaign in which one rotor is further from the others than any scatter makes it, however heavy
/// its tails: by medians, which several such runs do not move as they move a fit and its variance. What all
/// rotors of a run do may be its conditions' work, another speed's for example.
std::vector<SuspectRow> wild_runs(const Observations& observations);

/// Those that no scatter, however heavy its tails, is likely to have made.
std::vector<SuspectRow> gross_rows(const Observations& observations, const std::vector<SuspectRow>& suspects);

/// A condition that in one row lies as far from the others as a typing error puts it, or a run far away.
struct IsolatedValue {
  std::string row, covariate;
  double value = 0, low = 0, high = 0;  // low, high: of all other rows
};
std::vector<IsolatedValue> isolated_values(const Observations& observations);

/// Of a campaign: those whose runs are to be set aside at once. A condition five ranges away whose run gave
/// an ordinary thrust on the mean of its rotors (a run at another speed, on purpose, does not); and an air
/// temperature one range away whose run is far off, which the density made of it.
std::vector<IsolatedValue> mistyped_values(const Observations& observations);

}  // namespace tunnelrig
