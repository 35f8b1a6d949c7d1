#include "attribution/generator/sizing.h"

#include <map>
#include <numbers>

namespace tunnelrig::attribution {
namespace {

struct Spread {
  double rms = 0;
  double session_share = 0;  // of the variance, between sessions
};

struct Mean {
  double sum = 0;
  int count = 0;
  void add(double value) {
    sum += value;
    ++count;
  }
  double value() const { return count > 0 ? sum / count : 0; }
};

/// Relative change of every ordinary run of one rotor, without the means of locations.
Spread spread_of(const Effect& effect, double amplitude, const World& world, bool free_mean) {
  double square = 0, between = 0;
  int count = 0;
  for (std::size_t rotor = 0; rotor < kRotors; ++rotor) {
    if (effect.rotor && *effect.rotor != rotor) continue;
    std::vector<double> change(world.runs.size());
    std::map<std::string, Mean> places;
    const auto place = [&](const Conditions& run) { return free_mean ? std::string() : run.location; };
    for (std::size_t i = 0; i < change.size(); ++i) {
      if (world.runs[i].added) continue;
      change[i] = change_at(effect, {world, i, rotor}, amplitude);
      places[place(world.runs[i])].add(change[i]);
    }
    std::map<int, Mean> sessions;
    for (std::size_t i = 0; i < change.size(); ++i) {
      if (world.runs[i].added) continue;
      change[i] -= places[place(world.runs[i])].value();
      sessions[world.runs[i].session].add(change[i]);
      square += change[i] * change[i];
      ++count;
    }
    for (const auto& [id, mean] : sessions) between += mean.count * mean.value() * mean.value();
  }
  return {.rms = std::sqrt(square / count), .session_share = square > 0 ? between / square : 0};
}

double runs_per_session(const World& world) {
  double ordinary = 0;
  for (const Conditions& run : world.runs) ordinary += run.added ? 0 : 1;
  return ordinary / world.blocks;
}

double scatter_at(Level level, const World& world, const NoiseModel& noise) {
  return level == Level::kRun ? noise.run : noise.of_session_mean(runs_per_session(world));
}

Level level_of(const Spread& spread) { return spread.session_share > 0.5 ? Level::kSession : Level::kRun; }

double target_rms(const Effect& effect, double amplitude, const Settings& settings, const World& world,
                  const NoiseModel& noise, bool free_mean) {
  const Level level =
      settings.size_over_run_scatter ? Level::kRun : level_of(spread_of(effect, amplitude, world, free_mean));
  return settings.size * scatter_at(level, world, noise);
}

/// Known physics: excursions of the covariate by `factor` times those of `original`.
void scale(const Effect& effect, const World& original, World& world, double factor) {
  for (std::size_t i = 0; i < world.runs.size(); ++i) {
    if (original.runs[i].proposed) continue;
    world.runs[i] = original.runs[i];
    effect.scale_covariate(world.runs[i], factor);
  }
}

void scale_to(const Effect& effect, const Settings& settings, World& world, NoiseModel& noise,
              bool free_mean) {
  const World original = world;
  const double target = target_rms(effect, effect.theory, settings, world, noise, free_mean);
  double factor = 1;
  for (int step = 0; step < 12; ++step) {
    const double rms = spread_of(effect, effect.theory, world, free_mean).rms;
    if (std::abs(rms / target - 1) < 1e-4 || factor > 4) break;
    factor *= target / rms;
    scale(effect, original, world, std::min(factor, 4.0));
  }
  const double reached = spread_of(effect, effect.theory, world, free_mean).rms / target;
  if (std::abs(reached - 1) > 1e-3) {
    noise.run *= reached;
    noise.session *= reached;
  }
}

/// Where the effect begins to be seen, or 1e-3: most are in proportion to their amplitude, clipping is not.
double first_amplitude(const Effect& effect, const World& world, bool free_mean) {
  double amplitude = 1e-3 * effect.sign;
  for (int step = 0; step < 14 && !(spread_of(effect, amplitude, world, free_mean).rms > 0); ++step)
    amplitude *= 2;
  return amplitude;
}

double solve_amplitude(const Effect& effect, const Settings& settings, const World& world,
                       const NoiseModel& noise, bool free_mean) {
  double low = 0, high = first_amplitude(effect, world, free_mean);
  const double target = target_rms(effect, high, settings, world, noise, free_mean);
  const auto rms = [&](double amplitude) { return spread_of(effect, amplitude, world, free_mean).rms; };
  // in proportion, but for a little curvature: the secant through zero; bisection where that is not so
  for (int step = 0; step < 8 && !effect.clips; ++step) {
    const double now = rms(high);
    if (!(now > 0)) return high;
    high *= target / now;
  }
  if (!effect.clips) return high;
  while (rms(high) < target) high *= 1.3;
  for (int step = 0; step < 40; ++step) {
    const double middle = (low + high) / 2;
    (rms(middle) < target ? low : high) = middle;
  }
  return high;
}

/// A line in the spectrum is compared with the run scatter as volts: its rms over that is the size.
double line_amplitude(double size, const World& world, const NoiseModel& noise) {
  double thrust_N = 0;
  for (const Rotors& run : world.baseline_N)
    thrust_N += run[0] / static_cast<double>(world.baseline_N.size());
  return std::numbers::sqrt2 * size * noise.run * thrust_N * kGain_V_N;
}

}  // namespace

void measure(Sized& sized, const World& world, const NoiseModel& noise, bool free_mean) {
  if (!sized.effect.change) {  // a line: its rms as a share of thrust
    sized.rms = sized.amplitude / line_amplitude(1, world, noise) * noise.run;
    sized.rms_over_run = sized.rms_over_level = sized.rms / noise.run;
    return;
  }
  const Spread spread = spread_of(sized.effect, sized.amplitude, world, free_mean);
  sized.level = level_of(spread);
  sized.rms = spread.rms;
  sized.rms_over_run = spread.rms / noise.run;
  sized.rms_over_level = spread.rms / scatter_at(sized.level, world, noise);
}

Sized give_size(Effect effect, const Settings& settings, World& world, NoiseModel& noise, bool free_mean) {
  Sized sized{.effect = std::move(effect)};
  if (sized.effect.scale_covariate) {
    scale_to(sized.effect, settings, world, noise, free_mean);
    sized.amplitude = sized.effect.theory;
  } else if (sized.effect.change) {
    sized.amplitude = solve_amplitude(sized.effect, settings, world, noise, free_mean);
  } else {
    sized.amplitude = line_amplitude(settings.size, world, noise);
  }
  measure(sized, world, noise, free_mean);
  return sized;
}

}  // namespace tunnelrig::attribution
