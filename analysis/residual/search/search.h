// The search for effects, and for structure that has no name: what it adds to the model so far, and drops.
#pragma once

#include "analysis/residual/search/curve_scan.h"
#include "analysis/residual/search/in_groups.h"
#include "analysis/residual/search/questions.h"

#include <cstddef>
#include <optional>
#include <vector>

namespace tunnelrig {

class Search {
 public:
  Search(const Observations& observations, const std::vector<int>& rows,
         const std::vector<const Effect*>& effects, const SearchSettings& settings);
  Attribution run();
  /// Curves alone, on top of what was found on other runs of the same observations; `whole`: its fit to
  /// these.
  StructureLeft run_on_top_of(const Attribution& found, const JointFit& whole);

 private:
  /// The model without any effect; what was found before is forgotten.
  void begin();
  /// Whether runs scatter otherwise than they were taken to, beside the model and the best curve. Then the
  /// search has begun again, with such scatter.
  bool begin_with_scatter_of(const CurveScan& curves);

  // named effects: search_effects.cpp
  void add_effects();
  bool add_best_effect();
  std::vector<Ranked> ranking(const Scan& scan, NullMaxima& maxima) const;
  /// The best candidate whose parameters stay within physics and which predicts blocks that it has not seen.
  bool accept_first_sound(const Scan& scan, NullMaxima& maxima, Round& round);
  /// One of them, alike in all groups or with their own amplitudes. `beyond`: what it would be without
  /// bounds.
  bool accept(const Scan& scan, std::size_t best, NullMaxima& maxima, Round& round,
              std::optional<BeyondBounds>& beyond);
  bool accept_together(const Scan& scan, std::size_t i, double p);
  /// An effect that is nothing on the whole, because groups have it with either sign.
  bool accept_in_groups(const Term& way, double p);
  /// In place of a candidate with amplitudes of the groups' own: the same effect alike in all, if α lets it
  /// in.
  std::size_t alike_instead(const Scan& scan, std::size_t i) const;
  /// Effect t with an amplitude of each group's own, where the data ask for it; it is the newest then.
  bool let_groups_differ(std::size_t t, bool before_others);
  /// The first of the effects, the newest first, for which they do.
  bool let_any_differ();
  /// All steps, where a curve is new that was a part of the scatter when they were placed.
  void place_steps();
  /// What each accepted effect does for blocks that were not seen, beside all that was found.
  void measure_gains();
  void find_confounded();

  // effects that give way: search_swaps.cpp
  /// With a new effect in, an older one may be explained better by another, or not be beyond chance any more.
  void ask_older_again();
  /// Whether accepted effect t gave way: to another, or to nothing where neither is beyond chance.
  bool gives_way(std::size_t t);
  /// Or by another form of itself, which was chosen while the newer was not known: the likelier, where each
  /// parameter that a form has more must be worth a ratio test.
  bool change_a_form();
  void put_in_place(std::size_t t, const JointFit& tried, double p);
  /// Whether an effect is beyond chance among all candidates with the curves in: what was found while their
  /// structure was in the residual may have been a part of it. `without`: the fit without it.
  bool is_still_found(const Term& term, const JointFit& without);

  // structure without a name: search_curves.cpp
  /// `first`: the curves on top of the model as it is.
  void add_curves(const CurveScan& first);
  bool add_best_curve(const CurveScan& curves);
  void add_curve(const Curve& curve, double p);
  /// Waves find structure of any shape, but a straight line in them has bends, and a bend has its middle at
  /// that of the range: what they found becomes a smooth curve of as many columns as the data ask for.
  void smooth_curves(std::size_t first = 0);
  /// A name whose work a curve does as well was the wrong name for that curve.
  void drop_what_a_curve_replaces();
  /// Takes accepted effect t out, and gives the newest curve the straight part that no name takes any more.
  void give_way_to_curve(std::size_t t, const JointFit& without);
  /// What gave way to a curve, and then to another name over the same condition, may not be it any more.
  void forget_what_has_a_name();
  /// Whether a bend over its own covariate is there beside accepted effect t, and has that much of its size.
  bool bends_away(std::size_t t);
  void name_newest_curve(const JointFit& without);

  const Observations& whole_;
  SearchData data_;
  Found found_;
  Questions questions_;
  Attribution result_;  // but for what `found_` has
};

}  // namespace tunnelrig
