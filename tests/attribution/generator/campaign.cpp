#include "attribution/generator/campaign.h"

#include "attribution/effects/catalogue.h"
#include "datasets/error.h"

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
void reject_hidden(const Sized& sized, const World& world) {
  for (std::size_t run = 0; run < world.runs.size(); ++run) {
    for (std::size_t rotor = 0; rotor < kRotors; ++rotor) {
      if (std::abs(change_at(sized.effect, {world, run, rotor}, sized.amplitude)) < 0.5) continue;
      throw InputError(fmt::format(
          "--effect {}: this design cannot show it, coefficients of locations absorb it", sized.effect.name));
    }
  }
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
  for (const Sized& one : sized) reject_hidden(one, campaign.world);
  for (Sized& one : sized) measure(one, campaign.world, campaign.noise, campaign.open_space);
  return sized;
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
  Campaign campaign{.settings = settings, .truth = draw_truth(settings)};
  campaign.open_space = campaign.truth.design.places == Design::Places::kOpenSpace;
  campaign.world = plan_world(settings, campaign.truth.design);
  campaign.noise = draw_noise_model(settings);
  campaign.effects = size_effects(campaign);
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
