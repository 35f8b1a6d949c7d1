// One true effect: physics written from its definition, apart from every candidate that the analysis knows.
#pragma once

#include "attribution/generator/random.h"
#include "attribution/generator/world.h"

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace tunnelrig::attribution {

/// Where an effect is evaluated: one rotor of one run, `time_in_run_s` after the run's first frame.
struct Place {
  const World& world;
  std::size_t run = 0;
  std::size_t rotor = 0;
  double time_in_run_s = 0;

  const Conditions& conditions() const { return world.runs[run]; }
  double baseline_N() const { return world.baseline_N[run][rotor]; }
  double time_since_start_s() const { return conditions().time_since_motor_start_s + time_in_run_s; }
};

struct Parameter {
  std::string name, unit;
  double value = 0;
};

struct Effect {
  std::string name;
  bool in_library = true;               // a name of the list; otherwise made up
  std::vector<std::string> covariates;  // columns of runs.csv that it lives on
  std::optional<std::size_t> rotor;     // acts on this rotor only, from 0
  std::vector<Parameter> fixed;         // time constants, change-points

  /// The change of the reading over the baseline, relative, at an amplitude.
  std::function<double(const Place&, double amplitude)> change;
  std::string amplitude_unit = "1";
  double sign = 1;  // of the amplitude
  std::string amplitude_name = "amplitude";

  /// Known physics has no free amplitude: it is `theory`, and the excursions of the covariate about their
  /// centre are scaled by a factor until the effect has the size asked for. Empty otherwise.
  std::function<void(Conditions&, double factor)> scale_covariate;
  double theory = 1;

  /// Volts on top of the signal, for effects that show in spectra.
  std::function<double(const Place&, double amplitude)> waveform_V;
  bool clips = false;  // `change` is what the converter makes of the waveform, so raw counts have it already
};

/// Change over all rotors or the one that it acts on.
inline double change_at(const Effect& effect, const Place& place, double amplitude) {
  return !effect.change || (effect.rotor && *effect.rotor != place.rotor) ? 0
                                                                          : effect.change(place, amplitude);
}

}  // namespace tunnelrig::attribution
