#pragma once

#include "analysis/model/model_version.h"

#include <filesystem>
#include <string>

#include <nlohmann/json.hpp>

namespace tunnelrig::test {

/// What a campaign of these tests has: everything, unless a test takes something away.
struct CampaignParts {
  bool raw_data = true;              // else the rows give thrusts
  bool calibrated = true;            // where there are raw data
  bool tunnel = true;                // else every location is in open space
  bool open_space = true;            // OS, and both planes
  bool tares = true;                 // where there are raw data
  int rotors = 4;                    // fewer only without raw data
  int columns = 3, rows = 5;         // of the tunnel's locations
  std::string source;                // the runs' column `source`; empty: they have none
  std::string odd_label;             // of one more location, without a place in the tunnel
  int frames_lost = 0;               // of the first run
  int repeats = 2;                   // a session each
  double uneven_offset_percent = 0;  // of the rig, in U everywhere
};

/// Writes a campaign of the thesis's field as a folder beside `db` and imports it. Seeded: the same each
/// time.
void make_campaign(const std::filesystem::path& db, const CampaignParts& parts = {});

/// A table of two propellers at four speeds; its rows are worth a C_T where `with_thrust`.
void make_table(const std::filesystem::path& db, bool with_thrust = true);

/// What a stored model holds of its explanation, with a verdict.
nlohmann::ordered_json explanation(const std::string& verdict);

/// A version of the model that takes a curve over the air temperature out, with that explanation.
ModelVersion adopted_model();

}  // namespace tunnelrig::test
