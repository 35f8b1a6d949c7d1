// From residuals to named effects: the search, on the runs that are not sealed. docs/closed-loop-method.md
// has the protocol.
#pragma once

#include "analysis/residual/likelihood/joint_fit.h"

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace tunnelrig {

struct SearchSettings {
  double alpha = 0.02;
  int most_effects = 4;
  int most_curves = 3;
  std::size_t simulations = 999;
  std::uint64_t seed = 1;
  bool empirical = false;    // curves without a name are a part of the model after
  double session_ratio = 2;  // session scatter is an unknown where σ_session/σ_run is above it beyond doubt
  std::vector<Term> taken_back;  // found before and refuted: not tried on these rotors again
  std::function<void(const std::string&)> progress = [](const std::string&) {};
};

/// One line of a ranking.
struct Ranked {
  Term term;
  double evidence = 0;                       // −log10 p of its own
  double p = 1;                              // by the maximum over all candidates
  double amplitude = 0, standard_error = 0;  // mean and 0 where each group has its own
};

/// What one round of the search saw.
struct Round {
  std::vector<Ranked> ranking;      // best way of each effect, best first
  std::vector<double> null_maxima;  // what the largest evidence is where there is no effect
  double observed = 0;              // the largest evidence of the data
  double critical = 0;              // evidence that α asks for
  std::string outcome;              // in words: what was accepted, or why not
};

struct Accepted {
  Term term;
  double p = 1;
  bool together = false;           // found with others, none of which is seen alone
  double gain = 0;                 // fall of the leave-one-block-out error, response's unit
  std::vector<Ranked> confounded;  // one way of each effect that does as well
};

/// A candidate that fitted best by far, with an amplitude that physics does not allow.
struct BeyondBounds {
  Term term;
  double amplitude = 0;  // of its own unit, if nothing held it
};

/// One way of an effect that may do as well as a curve, and is not accepted.
struct CouldBe {
  Term term;
  bool on_all_blocks = false;  // they let it in; or else it was found before the curve, and given up for it
};

struct FoundCurve {
  Curve curve;
  double p = 1;
  std::vector<std::string> instead_of;  // effects that were in, until the curve showed their formulas wrong
  std::vector<CouldBe> could_be = {};   // one way of each effect
};

/// Structure that is beyond chance, and without one block is not: of that block, whatever it was.
struct OfOneBlock {
  std::string covariate;
  int rotor = -1;     // −1: all
  std::string label;  // of the curve: what it is over, where and of which rotor
  int block = 0;      // as observations number them
};

/// Sessions scatter far more than runs.
struct SessionScatter {
  int rotor = -1;  // −1: what several do
  double p = 1;    // of no more than the ratio that is asked for, by the likelihood over the grid
};

struct Attribution {
  std::vector<Accepted> accepted;
  std::vector<FoundCurve> curves;
  std::vector<BeyondBounds> beyond_bounds;
  std::vector<OfOneBlock> of_one_block;
  std::optional<SessionScatter> session_unknown = {};
  JointFit baseline, final;   // without and with the accepted terms and curves
  Observations observations;  // what `final` speaks of: with a group's own amplitudes among its baseline
  std::vector<Round> rounds, curve_rounds;
  double detectable_sigma = 0;  // rms, in y, from which any of the effects is found at 80 % power
  std::map<std::string, double> detectable_by_effect;  // likewise, of each
};

Attribution attribute(const Observations& observations, const std::vector<int>& rows,
                      const std::vector<const Effect*>& effects, const SearchSettings& settings);

/// Structure without a name that more runs show beside what was found on some of them.
struct StructureLeft {
  std::vector<FoundCurve> curves;
  std::vector<std::vector<CouldBe>> names;      // of each curve that was found before, on all `rows`
  std::vector<std::vector<Ranked>> confounded;  // of `accepted`, what all `rows` do not tell apart either
  JointFit fit;                                 // to all `rows`: what was found, and then these curves
  std::vector<OfOneBlock> of_one_block;
  std::vector<Round> rounds;   // of the search
  std::set<std::size_t> bent;  // of `accepted`: what its covariate does bends away from its formula
};
/// `found` speaks of its own observations, which must outlive the call. `whole`: its model fitted to `rows`,
/// a step where these put it: elsewhere it would leave a structure. `effects`: what the structure could be.
StructureLeft structure_left(const Attribution& found, const JointFit& whole, const std::vector<int>& rows,
                             const std::vector<const Effect*>& effects, const SearchSettings& settings);

}  // namespace tunnelrig
