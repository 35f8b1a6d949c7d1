// What a candidate effect is: a formula that changes a rotor's force, its parameters with bounds, and the
// measured conditions that it needs. One file each beside this one; docs/effects.md shows how to add another.
#pragma once

#include "datasets/campaign.h"

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <ceres/jet.h>

namespace tunnelrig {

/// The covariate that goes on within a run, where the others stand for the whole of it.
inline constexpr std::string_view kTimeSinceMotorStart = "time_since_motor_start_s";

inline constexpr int kMaxEffectParameters = 3;
using EffectJet = ceres::Jet<double, kMaxEffectParameters>;

/// What a formula may look at: one rotor of one run, at one time within the run.
struct Sample {
  std::span<const double> x;          // the effect's covariates, in the order in which it names them
  std::span<const double> reference;  // their typical values in the campaign (medians; kept when adopted)
  std::span<const double> at_zero;    // what they were at the tares that the run's zero is of; empty: no tare
  double time_s = 0;                  // since the run's first frame
  double previous_N = 0;  // predicted force of the run before, same rotor and session; NaN for the first
  double previous_error_N = 0;  // standard error of its difference from this run's, as far as it is known
  double other_N = 0;           // predicted force of the rotor that leaks into this one (crosstalk)
  double newtons_per_volt = 1;  // of the cell; 1 where the campaign gives forces
  double radius_m = 0;          // of this propeller: in a table rows may have propellers of any size
  const Rig* rig = nullptr;
};

/// Of what the zero of a cell does, as far as tares have not taken it off: covariate k of the sample, less
/// what it was at the tares; without tares less `otherwise`.
inline double since_zero(const Sample& s, std::size_t k, double otherwise) {
  return s.x[k] - (s.at_zero.empty() ? otherwise : s.at_zero[k]);
}

/// A parameter's role decides how it is found.
enum class ParameterRole {
  kAmplitude,    // the first one; 0 means that the effect is absent
  kShape,        // a time constant or length: tried on a grid, then refined
  kChangePoint,  // a run's number: tried at the first of each session that leaves enough on both sides
};

struct EffectParameter {
  std::string name, unit;
  double lower = 0, upper = 0;  // physical bounds, in the unit
  ParameterRole role = ParameterRole::kAmplitude;
  std::vector<double> grid;      // kShape: where the search begins
  std::optional<double> theory;  // the value that known physics gives it

  // Of what a cell reads: where that is not in volts, or newtons, unit and bounds are others.
  bool in_volts() const { return unit == "V" || unit.starts_with("V/"); }
  bool per_newton() const { return unit == "1/N"; }
};

/// Where an effect acts, and so in which ways it is tried.
enum class EffectScope {
  kShared,  // on all rotors alike: air, supply, tunnel
  kRotor,   // on all alike, or on one rotor or cell alone
  kPair,    // from one rotor's cell into another's
};

/// What makes it, where that says of which responses an effect can be tried.
enum class EffectOrigin {
  kAny,          // no rule but its conditions
  kAirPressure,  // this and the next two: the density of the air
  kAirTemperature,
  kAirHumidity,
  kCellInAir,       // the temperature of a cell, for which the air's stands
  kWind,            // air that passes through a rotor
  kSpeedSquared,    // the law by which forces go with the rotor's speed
  kCharacteristic,  // what a cell makes of the force alone
  kOffset,          // a constant beside the force
  kSupply,          // what the motor is driven with, which acts by the speed
  kMotor,           // what becomes of a motor while it runs
};

struct Effect {
  std::string name;     // as docs/effects.md lists it; forms of one effect share it
  std::string form;     // which form; empty where there is one
  std::string formula;  // with F, the force without the effect
  std::string physics;  // one line, with its source
  std::vector<EffectParameter> parameters;
  std::vector<std::string> covariates;  // columns of runs.csv, or derived ones (docs/effects.md)
  EffectScope scope = EffectScope::kShared;
  EffectOrigin origin = EffectOrigin::kAny;
  bool tunnel_only = false;  // acts at tunnel locations only
  bool theory_only = false;  // the amplitude is theory's whenever the effect is adopted
  bool additive = false;     // adds a force, where others scale it
  bool of_reading = false;   // scales what a cell reads, whatever load makes it read so
  bool of_zero = false;      // is in the tares as well, which take it off
  bool needs_previous = false;
  bool needs_both_signs = false;  // of the force
  bool needs_diameters = false;   // of a table's propellers, which differ from row to row
  bool form_is_axis = false;      // its form names a table's axis that leaks into the response
  bool rare = false;              // another of the same condition is the likelier cause by far
  std::string sign_rule;          // what the bounds of the amplitude mean, in words

  std::function<double(const Sample&, const double*, double)> force_N;
  std::function<EffectJet(const Sample&, const EffectJet*, const EffectJet&)> jet_N;

  bool within_time() const;                         // changes within a run
  std::optional<std::size_t> change_point() const;  // the parameter that says at which run it begins
  bool has_change_point() const { return change_point().has_value(); }
  bool of_other_axis() const { return form_is_axis || scope == EffectScope::kPair; }
  bool of_force_alone() const {
    return covariates.empty() && scope != EffectScope::kPair && !needs_previous && !has_change_point();
  }
  /// What it says the cause is: its name, whatever its form; of a table's other axes the axis as well.
  std::string cause() const;
  /// "crosstalk from rotor 1 to rotor 2"; rotors from 0, −1: of all, from none.
  std::string label(int rotor, int from = -1) const;
  std::optional<double> theory() const { return parameters[0].theory; }
  /// Where effects add forces, each acts on what those of the stages before have made: 0 the rotor and its
  /// air, 1 the cell, 2 what scales its reading, 3 what is added to that.
  int stage() const { return additive ? 3 : of_reading ? 2 : scope == EffectScope::kShared ? 0 : 1; }
};

/// Places of effects of these stages, the first to act first; of one stage in the order given.
std::vector<std::size_t> order_of_action(const std::vector<int>& stages);

/// Completes a description by its formula: a functor `T operator()(const Sample&, const T* p, const T& F)
/// const`.
template <class Formula>
Effect make_effect(Effect description) {
  description.force_N = [](const Sample& s, const double* p, double force) { return Formula()(s, p, force); };
  description.jet_N = [](const Sample& s, const EffectJet* p, const EffectJet& force) {
    return Formula()(s, p, force);
  };
  return description;
}

/// 2 s to half an hour, five values a decade: time constants that a run or a session can show.
std::vector<double> time_constants_s();

/// Images in ground or ceiling are of a rotor that is far away compared with its radius: nearer than this the
/// formula is held, which also keeps the strongest of images clear of its pole.
inline constexpr double kNearestImage_R = 0.5;

/// Every candidate of this folder, forms of one effect next to each other.
const std::vector<Effect>& all_effects();

}  // namespace tunnelrig
