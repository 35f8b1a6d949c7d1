#include "attribution/generator/campaign.h"
#include "attribution/generator/oracle.h"

#include <nlohmann/json.hpp>

namespace tunnelrig::attribution {
namespace {

using nlohmann::ordered_json;

/// The parameter in every unit that one may state it in: newtons or the volts that they are.
ordered_json in_units(const std::string& name, const std::string& unit, double value) {
  ordered_json list = ordered_json::array({{{"name", name}, {"unit", unit}, {"value", value}}});
  if (unit.starts_with("N")) {
    list.push_back({{"name", name}, {"unit", "V" + unit.substr(1)}, {"value", value * kGain_V_N}});
  }
  return list;
}

ordered_json effect_json(const Sized& sized, const Campaign& campaign) {
  const Effect& effect = sized.effect;
  ordered_json parameters = in_units(effect.amplitude_name, effect.amplitude_unit, sized.amplitude);
  for (const Parameter& parameter : effect.fixed) {
    parameters.push_back({{"name", parameter.name}, {"unit", parameter.unit}, {"value", parameter.value}});
  }
  return {{"effect", effect.name},
          {"in_library", effect.in_library},
          {"covariates", effect.covariates},
          {"rotor", effect.rotor ? ordered_json(*effect.rotor + 1) : ordered_json(nullptr)},
          {"level", sized.level == Level::kRun ? "run" : "session"},
          {"rms", sized.rms},
          {"rms_over_run_scatter", sized.rms_over_run},
          {"rms_over_level_scatter", sized.rms_over_level},
          {"distance_from_none_sigma", distance_sigma(changes_of(effect, sized.amplitude, campaign.world), {},
                                                      campaign.world, campaign.noise, campaign.open_space)},
          {"parameters", parameters}};
}

std::string truth_class(const Settings& settings) {
  return kTrackNames[static_cast<std::size_t>(settings.track)];
}

ordered_json design_json(const Campaign& campaign) {
  constexpr std::array kPlaces = {"grid", "tunnel", "reference", "open_space"};
  const Settings& settings = campaign.settings;
  return {{"noise", kNoiseNames[static_cast<std::size_t>(settings.noise)]},
          {"order", kOrderNames[static_cast<std::size_t>(settings.order)]},
          {"blocks", settings.blocks},
          {"runs", settings.runs},
          {"places", kPlaces[static_cast<std::size_t>(campaign.truth.design.places)]},
          {"thrust_spread", campaign.truth.design.thrust_spread},
          {"unequal_repeats", settings.unequal_repeats},
          {"missing_cells", settings.missing_cells},
          {"switches", settings.switches},
          {"raw", settings.raw}};
}

}  // namespace

std::string key_json(const Campaign& campaign) {
  ordered_json key = {{"format", "tunnelrig-attribution-key/1"},
                      {"seed", campaign.settings.seed},
                      {"track", kTrackNames[static_cast<std::size_t>(campaign.settings.track)]},
                      {"truth_class", truth_class(campaign.settings)},
                      {"size", campaign.settings.size},
                      {"design", design_json(campaign)},
                      {"effects", ordered_json::array()},
                      {"acceptable", campaign.truth.acceptable},
                      {"unrecorded", campaign.truth.unrecorded},
                      {"run_scatter", campaign.noise.run},
                      {"session_scatter", campaign.noise.session},
                      {"noise_floor",
                       {{"run_N", campaign.floor.run_N},
                        {"session_N", campaign.floor.session_N},
                        {"root_N", campaign.floor.root_N},
                        {"with_coefficients_N", campaign.floor.with_coefficients_N}}},
                      {"explain_arguments", ordered_json::array()}};
  for (const Sized& effect : campaign.effects) key["effects"].push_back(effect_json(effect, campaign));
  if (campaign.open_space) key["explain_arguments"] = {"--baseline", "open_space"};
  return key.dump(1) + "\n";
}

}  // namespace tunnelrig::attribution
