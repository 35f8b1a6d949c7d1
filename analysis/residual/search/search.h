// The search for effects, and for structure that has no name, as one state: the model so far, and what was
// seen on the way.
#pragma once

#include "analysis/residual/scatter/condition_scatter.h"
#include "analysis/residual/search/attribution.h"
#include "analysis/residual/search/draws.h"
#include "analysis/residual/search/found.h"
#include "analysis/residual/search/search_data.h"

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace tunnelrig {

/// Of log likelihood, what one parameter brings by chance once in twenty: a ratio test at 5 %.
inline constexpr double kRatioOfOneParameter = 1.92;

class NullMaxima;

class Search {
 public:
  Search(const Observations& observations, const std::vector<int>& rows,
         const std::vector<const Effect*>& effects, const SearchSettings& settings);
  Attribution run();
  /// Curves alone, on top of what was found on other runs of the same observations; `whole`: its fit to
  /// these.
  StructureLeft run_on_top_of(const Attribution& found, const JointFit& whole);

 private:
  struct Scan {
    std::vector<Term> ways;
    std::vector<Candidate> candidates;
    std::vector<CandidateFit> fits;
    std::unique_ptr<CandidateScan> scan;
    std::vector<std::size_t> order;                        // by evidence, best first
    std::map<std::size_t, std::vector<Term>> others = {};  // of ways that are several effects: but the first
  };

  struct CurveScan {
    Scan scan;                 // without ways
    std::vector<Curve> tried;  // its candidates
  };

  /// The model without any effect; what was found before is forgotten.
  void begin();
  /// With this scatter.
  void begin_with(RunScatter scatter);

  // named effects: search_effects.cpp
  void add_effects();
  bool already_in(const Term& way, const MeanModel& model) const;
  /// All candidates on top of a model, but for what it has, with one amplitude for all groups.
  Scan scan_effects(const JointFit& base) const;
  /// And with an amplitude of each group's own.
  Scan scan_effects_and_groups(const JointFit& base) const;
  Scan list_effects(const JointFit& base) const;  // as scan_effects, without fits
  /// What a fit makes of an effect that its physical bounds do not hold; nothing where it stays within them.
  std::optional<BeyondBounds> beyond_bounds(Term way, double start) const;
  /// Whether more of an effect than physics allows was found, and is described by a curve: what is left of it
  /// on one rotor is no effect of its own.
  bool was_beyond_bounds(const Term& way) const;
  Candidate candidate_of(const Term& way, const Eigen::MatrixXd& predicted) const;
  void rank(const JointFit& base, Scan& scan) const;
  bool add_best_effect();
  std::vector<Ranked> ranking(const Scan& scan, NullMaxima& maxima) const;
  /// The best candidate whose parameters stay within physics and which predicts blocks that it has not seen.
  bool accept_first_sound(const Scan& scan, NullMaxima& maxima, Round& round);
  /// One of them, alike in all groups or with their own amplitudes. `beyond`: what it would be without
  /// bounds.
  bool accept(const Scan& scan, std::size_t best, NullMaxima& maxima, Round& round,
              std::optional<BeyondBounds>& beyond);
  /// What each accepted effect does for blocks that were not seen, beside all that was found.
  void measure_gains();
  /// The rule that keeps a fit's last term out, in words; nothing where none does. `after`: its leave-one-
  /// block-out losses; `gain`: theirs on those without the term.
  std::optional<std::string> why_not(const JointFit& fit, const CrossValidation& after,
                                     const LossDifference& gain) const;
  /// An effect over a condition of the model's last that is, together with that, no more than a small part of
  /// either: two formulas that differ little make any shape over it. None: null. Of `fit`.
  const Term* cancelled_by_newest(const JointFit& fit) const;
  /// The covariate that an effect shares with an accepted one, if a bend over it predicts unseen blocks about
  /// as well: what two names over one covariate do together, a curve does too, and their sum is no evidence
  /// of a second cause.
  std::optional<std::string> only_bends(const Term& term, const NullFit& variances,
                                        const CrossValidation& with_term) const;
  struct InGroups;  // the model with a last term whose amplitude is each group's own
  void add_group_ways(Scan& scan) const;
  InGroups fit_in_groups(Term term, MeanModel model) const;
  /// Whether they predict unseen blocks better, within the bounds of physics. `before_others`: and no other
  /// name does as well for all groups alike.
  bool are_better(const InGroups& own, bool before_others) const;
  void take(InGroups own);
  /// Effect t with an amplitude of each group's own, where the data ask for it; it is the newest then.
  bool let_groups_differ(std::size_t t, bool before_others);
  /// The first of the effects, the newest first, for which they do.
  bool let_any_differ();
  /// An effect that is nothing on the whole, because groups have it with either sign.
  bool accept_in_groups(const Term& way, double p);
  /// In place of a candidate with amplitudes of the groups' own: the same effect alike in all, if α lets it
  /// in.
  std::size_t alike_instead(const Scan& scan, std::size_t i) const;
  bool groups_within_bounds(const Observations& wider, const JointFit& fit, std::size_t t) const;
  static constexpr double kWeightInGroups = 0.25;  // as for one rotor alone
  /// p of the F-test of amplitudes of the groups' own, which `wider` has as slopes beside those of `fewer`.
  double p_of_groups(const Observations& fewer, const JointFit& without, const Observations& wider,
                     const JointFit& with) const;
  bool another_does_as_well(const CrossValidation& own, const NullFit& variances) const;
  /// Whether it is one of the measured speed, of which the model does not have the square.
  bool lacks_speed_squared(const Term& term) const;
  /// Of a term that is a step, counted from the newest (1): from the run on where it is likeliest.
  JointFit at_best_run(JointFit fit, std::size_t from_newest);
  /// All steps, where a curve is new that was a part of the scatter when they were placed.
  void place_steps();
  // several of which none can be seen alone: search_several.cpp
  static void add_together(Scan& scan, const std::vector<std::size_t>& ways, double weight);
  void add_pairs_of_steps(Scan& scan) const;  // of two rotors at one run
  void add_several_axes(Scan& scan) const;    // of a table: crosstalk from each two, and from all
  JointFit fit_with_all(const std::vector<Term>& terms) const;
  /// Those that are there beside the others.
  std::vector<Term> needed_of(std::vector<Term> terms) const;
  /// Whether one of those that were left out does about as well in place of another. `all`: the terms' fit.
  bool may_be_another(const std::vector<Term>& terms, const std::vector<Term>& left_out,
                      const JointFit& all) const;
  bool accept_together(const Scan& scan, std::size_t i, double p);
  /// Whether a course that is straight or bends up to twice over the order of runs does as well as the step,
  /// or a bend of the baseline's own law.
  bool is_gradual(const std::vector<Term>& steps, const NullFit& variances,
                  const CrossValidation& with_steps) const;
  /// Of the runs' means within the fit, and its degrees of freedom.
  std::pair<double, double> sum_of_squares(const Observations& observations, const JointFit& fit,
                                           const NullFit& variances) const;
  /// A joint fit with one term more; theory's coefficient where the data do not speak against it.
  JointFit fit_with(Term term, double amplitude) const { return fit_with(found_.fit, term, amplitude); }
  JointFit fit_with(const JointFit& base, Term term, double amplitude) const;
  /// p of a likelihood ratio of one parameter of a fitted model: few rows are no large sample.
  double ratio_p(double ratio, const JointFit& fit) const;
  /// With a new effect in, an older one may be explained better by another, or not be beyond chance any more.
  void ask_older_again();
  /// Whether accepted effect t gave way: to another, or to nothing where neither is beyond chance.
  bool gives_way(std::size_t t);
  /// Or by another form of itself, which was chosen while the newer was not known: the likelier, where each
  /// parameter that a form has more must be worth a ratio test.
  bool change_a_form();
  void put_in_place(std::size_t t, const JointFit& tried, double p);
  double evidence_of(const Scan& scan, const Term& term) const;
  JointFit fit_without(std::size_t t) const { return fit_without(t, data_.observations()); }
  JointFit fit_without(std::size_t t, const Observations& observations) const;
  /// What each effect must be to reach the critical evidence in four of five data sets drawn from the null
  /// model (the typical one of its forms and shapes): of what varies from session to session far more is
  /// needed than of what varies from run to run.
  void set_detectable(const Scan& scan);
  /// For the data that are drawn once more: scatter may go with anything, but what a candidate explains of
  /// the runs is none. Nothing of few runs, whose signs make too few data sets.
  std::vector<Eigen::MatrixXd> sizes_beside(const JointFit& fit, const Candidate& candidate,
                                            const CandidateFit& found) const;
  /// Whether a candidate has most of its evidence from the runs but for these (places in `rows_`).
  bool is_found_without(const std::vector<Eigen::Index>& places, const JointFit& fit,
                        const Candidate& candidate, const CandidateFit& found) const;
  /// What chance makes of a scan on top of a fit, whose best candidate counts as no scatter. Refers to
  /// `scan` and `settings`.
  NullMaxima maxima_of(const JointFit& fit, const Scan& scan, Draws what);
  NullMaxima maxima_of(const JointFit& fit, const Scan& scan, Draws what, const SearchSettings& settings);

  // what runs scatter like: search_scatter.cpp
  /// Whether runs, rotors or locations scatter unlike each other, or neighbouring runs resemble each other,
  /// beside the model and the best curve, whose own part must not count as scatter. Then the search has begun
  /// again, with such scatter.
  bool begin_with_scatter_of(const CurveScan& curves);
  struct ScatterBeside {
    std::vector<Components> columns;
    ScatterFit scatter;
  };
  /// Of single rotors over one condition, those that explain the most together; none where chance does as
  /// much.
  static std::vector<Curve> of_each_rotor(const CurveScan& curves);
  /// Beside the model and the best curve, if that has this evidence; or without the curve, where scatter is
  /// likelier.
  ScatterBeside scatter_beside(const CurveScan& curves, double least_evidence, std::mt19937_64& random) const;

  // structure without a name: search_curves.cpp
  /// All curves on top of the model.
  CurveScan scan_curves() const;
  /// `first`: the curves on top of the model as it is.
  void add_curves(const CurveScan& first);
  bool add_best_curve(const CurveScan& curves);
  /// The best one; where that goes with a place, the same everywhere if it predicts about as well.
  std::size_t everywhere_instead(const CurveScan& curves) const;
  /// Waves find structure of any shape, but a straight line in them has bends, and a bend has its middle at
  /// that of the range: what they found becomes a smooth curve of as many columns as the data ask for.
  void smooth_curves(std::size_t first = 0);
  /// A name whose work a curve does as well was the wrong name for that curve.
  void drop_what_a_curve_replaces();
  /// Whether an effect is beyond chance among all candidates with the curves in: what was found while their
  /// structure was in the residual may have been a part of it. `without`: the fit without it.
  bool is_still_found(const Term& term, const JointFit& without);
  /// What gave way to a curve, and then to another name over the same condition, may not be it any more.
  void forget_what_has_a_name();
  /// Whether the newest curve, over a covariate of this effect or one that tells as much, has more of the
  /// effect's size than its formula may leave: then the effect was only the curve's straight part.
  bool outshone_by_curve(const Term& term) const;
  Eigen::MatrixXd made_by_newest_curve() const;
  /// Whether a bend over its own covariate is there beside accepted effect t, and has that much of its size.
  bool bends_away(std::size_t t);
  void add_curve(const Curve& curve, double p);
  /// Whether a curve over the same covariate and rotor is in, or over one that goes with it.
  bool is_described(const Curve& curve) const;
  /// Whether what it is over is all but told by what a found one is over: beside each other both could have
  /// any size.
  bool go_together(const Curve& found, const Curve& curve) const;
  /// The same, and gives the newest curve the straight part that no name takes any more.
  void give_way_to_curve(std::size_t t, const JointFit& without);
  /// Of what an effect makes of its conditions, `made` per unit of its amplitude on top of `predicted`, the
  /// share that does not go with what the curve is over.
  double share_beside(const Curve& curve, const Term& term, const Eigen::MatrixXd& made,
                      const Eigen::MatrixXd& predicted) const;
  /// Whether a curve is of an effect's rotors, the same everywhere, and nothing was taken out of it.
  static bool is_whole_curve_of(const Curve& curve, const Term& term);
  /// Whether a curve does nearly all that an effect's conditions do, so that a name beside it means nothing.
  bool is_work_of_a_curve(const Term& term, const Eigen::MatrixXd& made,
                          const Eigen::MatrixXd& predicted) const;
  /// Nothing where it is not.
  std::optional<SessionScatter> session_scatter_is_large() const;

  // what cannot be told apart: search_rivals.cpp
  void find_confounded();
  /// One way of each other effect that α would let in and that predicts unseen blocks about as well.
  std::vector<Ranked> rivals(const Accepted& accepted, const JointFit& without, const Scan& scan) const;
  static bool within_bounds(const Scan& scan, std::size_t i);
  /// The same for an effect with an amplitude of each group's own: each rival takes its place in the
  /// baseline.
  std::vector<Ranked> rivals_in_groups(const Accepted& accepted) const;
  /// Effects that step 3 would accept in the newest curve's place, and that predict unseen blocks about as
  /// well. `without`: the fit without the curve.
  void name_newest_curve(const JointFit& without);
  CrossValidation unseen(const JointFit& fit, const NullFit& variances) const {
    return unseen(data_.observations(), fit, variances);
  }
  CrossValidation unseen(const Observations& observations, const JointFit& fit,
                         const NullFit& variances) const;
  /// Those of the fit, and these.
  std::vector<Components> columns_with(const std::vector<Components>& more) const;
  /// Of what has been found with these columns in place of its own.
  CrossValidation unseen_with(const std::vector<Components>& columns, const NullFit& variances) const;

  const Observations& whole_;
  SearchData data_;
  Found found_;
  Attribution result_;           // but for what `found_` has
  std::uint64_t questions_ = 0;  // that data sets were drawn for
};

}  // namespace tunnelrig
