// What a generated campaign is asked to be.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace tunnelrig::attribution {

enum class Track { kNone, kOne, kTwo, kConfounded, kOutside, kNotRecorded };
enum class Noise { kWhite, kSession, kAutocorrelated, kHeavyTailed };
enum class Order { kRandomised, kSwept };

inline constexpr std::array<const char*, 6> kTrackNames = {"none",       "one",     "two",
                                                           "confounded", "outside", "not_recorded"};
inline constexpr std::array<const char*, 4> kNoiseNames = {"white", "session", "autocorrelated",
                                                           "heavy_tailed"};
inline constexpr std::array<const char*, 2> kOrderNames = {"randomised", "swept"};

/// A run that was proposed to tell two effects apart.
struct SeparatingRun {
  std::map<std::string, double> setting;  // column of runs.csv to the value it is brought to
  std::string location;                   // empty: any
};

struct Settings {
  Track track = Track::kNone;
  Noise noise = Noise::kWhite;
  Order order = Order::kRandomised;
  int blocks = 18;
  int runs = 215;
  double size = 1;                   // rms of each effect over the scatter at the level where it varies
  std::vector<std::string> effects;  // empty: drawn from those that the track has
  std::uint64_t seed = 1;
  bool unequal_repeats = false;
  bool missing_cells = false;
  bool switches = false;  // runs.csv has a switch and a column of texts, and they are what is true outside
  bool raw = false;       // arrays of counts instead of thrusts
  double raw_duration_s = 6;
  std::vector<SeparatingRun> separating;

  bool size_over_run_scatter = false;  // whatever the level, sizes are over the run scatter
  double run_scatter = 0.0024;         // relative, of one rotor
  int separating_sessions = 4, separating_repeats = 6;
};

}  // namespace tunnelrig::attribution
