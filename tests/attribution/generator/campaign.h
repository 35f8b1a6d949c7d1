// A generated campaign: what truly happened, what was measured, and the key to it.
#pragma once

#include "attribution/generator/sizing.h"
#include "attribution/generator/tracks.h"

#include <filesystem>

namespace tunnelrig::attribution {

struct Campaign {
  Settings settings;
  Truth truth;
  World world;
  NoiseModel noise;
  NoiseFloor floor;
  std::vector<Sized> effects;
  std::vector<Rotors> scatter;     // relative, of each run and rotor
  std::vector<Rotors> measured_N;  // thrusts as read
  bool open_space = false;         // one baseline coefficient for all heights
};

/// Same settings, same campaign. Throws InputError for settings that no campaign can have.
Campaign generate(const Settings& settings);

/// Reading of a rotor over its baseline, relative, with effects and scatter, at a time within the run.
double reading_over_baseline(const Campaign& campaign, std::size_t run, std::size_t rotor,
                             double time_in_run_s);

/// Writes the campaign folder (docs/campaign-folder.md), which must not exist yet.
void write_folder(const Campaign& campaign, const std::filesystem::path& folder);

/// The sealed key as JSON (docs/attribution-benchmark.md).
std::string key_json(const Campaign& campaign);

}  // namespace tunnelrig::attribution
