#include "attribution/generator/campaign.h"

#include "attribution/effects/catalogue.h"
#include "datasets/error.h"

#include <algorithm>

namespace tunnelrig::attribution {
namespace {

void check(const Settings& settings) {
  if (settings.blocks < 1 || settings.blocks > 200) {
    throw InputError(fmt::format("--blocks {}: 1 to 200 sessions", settings.blocks));
  }
  if (settings.runs < 2 * settings.blocks || settings.runs > 20000) {
    throw InputError(fmt::format("--runs {}: at least two for each of {} sessions, at most 20000",
                                 settings.runs, settings.blocks));
  }
  if (!(settings.size > 0 && settings.size <= 100)) {
    throw InputError(fmt::format("--size {:g}: above 0, at most 100 times the scatter", settings.size));
  }
  if (!(settings.run_scatter > 0 && settings.run_scatter < 0.1)) {
    throw InputError(
        fmt::format("--run-scatter {:g}: a share of thrust, above 0 and below 0.1", settings.run_scatter));
  }
}

/// An effect that the coefficients of the locations absorb takes absurd amplitudes to leave anything behind.
bool is_hidden(const Sized& sized, const World& world) {
  for (std::size_t run = 0; run < world.runs.size(); ++run) {
    for (std::size_t rotor = 0; rotor < kRotors; ++rotor) {
      if (!(std::abs(change_at(sized.effect, {world, run, rotor}, sized.amplitude)) < 0.5)) return true;
    }
  }
  return false;
}

/// Each truth with its amplitude. Known physics goes first, since it may change covariates and noise.
std::vector<Sized> size_effects(Campaign& campaign) {
  Random random(campaign.settings.seed, "effects");
  std::vector<Effect> effects;
  for (const std::string& name : campaign.truth.effects) {
    effects.push_back(make_effect(name, random));
    if (campaign.truth.sign != 0) effects.back().sign = campaign.truth.sign;
  }
  std::stable_partition(effects.begin(), effects.end(),
                        [](const Effect& e) { return bool(e.scale_covariate); });
  std::vector<Sized> sized;
  sized.reserve(effects.size());
  for (Effect& effect : effects) {
    sized.push_back(
        give_size(std::move(effect), campaign.settings, campaign.world, campaign.noise, campaign.open_space));
  }
  return sized;
}

/// Truth, design, world and effects of an attempt.
void draw_effects(Campaign& campaign, int attempt) {
  const Settings& settings = campaign.settings;
  campaign.truth = draw_truth(settings, attempt);
  campaign.open_space = campaign.truth.design.places == Design::Places::kOpenSpace;
  campaign.world = plan_world(settings, campaign.truth.design);
  campaign.noise = draw_noise_model(settings);
  campaign.effects = size_effects(campaign);
}

/// The attempt whose effects show. A small campaign may hide one that was drawn, and another is drawn; one
/// that was asked for is refused. Runs that are added later to separate effects do not change the choice.
int attempt_that_shows(Settings settings) {
  constexpr int kAttempts = 20;
  settings.separating.clear();
  for (int attempt = 0;; ++attempt) {
    Campaign campaign{.settings = settings};
    draw_effects(campaign, attempt);
    const auto hidden = std::find_if(campaign.effects.begin(), campaign.effects.end(),
                                     [&](const Sized& one) { return is_hidden(one, campaign.world); });
    if (hidden == campaign.effects.end()) return attempt;
    if (!settings.effects.empty() || attempt + 1 == kAttempts)
      throw InputError(
          fmt::format("--effect {}: this design cannot show it, coefficients of locations absorb it",
                      hidden->effect.name));
  }
}

}  // namespace

double reading_over_baseline(const Campaign& campaign, std::size_t run, std::size_t rotor,
                             double time_in_run_s) {
  double change = 0;
  for (const Sized& effect : campaign.effects) {
    if (campaign.settings.raw && effect.effect.clips) continue;
    change += change_at(effect.effect, {campaign.world, run, rotor, time_in_run_s}, effect.amplitude);
  }
  return (1 + change) * (1 + campaign.scatter[run][rotor]);
}

Campaign generate(const Settings& settings) {
  check(settings);
  Campaign campaign{.settings = settings};
  draw_effects(campaign, attempt_that_shows(settings));
  for (const Sized& one : campaign.effects)
    for (const std::string& column : one.effect.covariates)
      campaign.settings.switches |= column == "fan_on" || column == "blade_set";
  for (Sized& one : campaign.effects) measure(one, campaign.world, campaign.noise, campaign.open_space);
  campaign.floor = noise_floor(campaign.noise, campaign.world);
  campaign.scatter = draw_noise(campaign.noise, campaign.world, settings.seed);
  for (std::size_t run = 0; run < campaign.world.runs.size(); ++run) {
    Rotors measured_N{};
    for (std::size_t rotor = 0; rotor < kRotors; ++rotor) {
      measured_N[rotor] =
          campaign.world.baseline_N[run][rotor] * reading_over_baseline(campaign, run, rotor, 0);
    }
    campaign.measured_N.push_back(measured_N);
  }
  return campaign;
}

}  // namespace tunnelrig::attribution
