#include "attribution/generator/sizing.h"

#include <map>

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
      if (world.runs[i].proposed) continue;
      change[i] = change_at(effect, {world, i, rotor}, amplitude);
      places[place(world.runs[i])].add(change[i]);
    }
    std::map<int, Mean> sessions;
    for (std::size_t i = 0; i < change.size(); ++i) {
      if (world.runs[i].proposed) continue;
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
  for (const Conditions& run : world.runs) ordinary += run.proposed ? 0 : 1;
  return ordinary / world.blocks;
}

double scatter_at(Level level, const World& world, const NoiseModel& noise) {
  return level == Level::kRun ? noise.run : noise.of_session_mean(runs_per_session(world));
}

Level level_of(const Spread& spread) { return spread.session_share > 0.5 ? Level::kSession : Level::kRun; }

/// Known physics: excursions of the covariate by `factor` times those of `original`.
void scale(const Effect& effect, const World& original, World& world, double factor) {
  for (std::size_t i = 0; i < world.runs.size(); ++i) {
    if (original.runs[i].proposed) continue;
    world.runs[i] = original.runs[i];
    effect.scale_covariate(world.runs[i], factor);
  }
}

void scale_to(const Effect& effect, double size, World& world, NoiseModel& noise, bool free_mean) {
  const World original = world;
  const Level level = level_of(spread_of(effect, effect.theory, world, free_mean));
  const double target = size * scatter_at(level, world, noise);
  double factor = 1;
  for (int step = 0; step < 12; ++step) {
    const double rms = spread_of(effect, effect.theory, world, free_mean).rms;
    if (std::abs(rms / target - 1) < 1e-4 || factor > 4) break;
    factor *= target / rms;
    scale(effect, original, world, std::min(factor, 4.0));
  }
  const double reached = spread_of(effect, effect.theory, world, free_mean).rms / target;
  if (reached < 0.999) {
    noise.run *= reached;
    noise.session *= reached;
  }
}

double solve_amplitude(const Effect& effect, double size, const World& world, const NoiseModel& noise,
                       bool free_mean) {
  double amplitude = 1e-3 * effect.sign;
  const Level level = level_of(spread_of(effect, amplitude, world, free_mean));
  const double target = size * scatter_at(level, world, noise);
  // nearly proportional, so a few steps of the secant through zero are enough
  for (int step = 0; step < 8; ++step) {
    const double rms = spread_of(effect, amplitude, world, free_mean).rms;
    if (!(rms > 0)) return amplitude;
    amplitude *= target / rms;
  }
  return amplitude;
}

}  // namespace

void measure(Sized& sized, const World& world, const NoiseModel& noise, bool free_mean) {
  if (!sized.effect.change) return;
  const Spread spread = spread_of(sized.effect, sized.amplitude, world, free_mean);
  sized.level = level_of(spread);
  sized.rms = spread.rms;
  sized.rms_over_run = spread.rms / noise.run;
  sized.rms_over_level = spread.rms / scatter_at(sized.level, world, noise);
}

Sized give_size(Effect effect, double size, World& world, NoiseModel& noise, bool free_mean) {
  Sized sized{.effect = std::move(effect)};
  if (sized.effect.scale_covariate) {
    scale_to(sized.effect, size, world, noise, free_mean);
    sized.amplitude = sized.effect.theory;
  } else if (sized.effect.change) {
    sized.amplitude = solve_amplitude(sized.effect, size, world, noise, free_mean);
  }
  measure(sized, world, noise, free_mean);
  return sized;
}

}  // namespace tunnelrig::attribution
