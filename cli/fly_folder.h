// The folder of `fly --out`.
#pragma once

#include "analysis/maps/staging.h"
#include "cli/fly_output.h"

#include <filesystem>
#include <string>
#include <vector>

namespace tunnelrig::cli {

/// Everything appears in it at once, and nothing where something fails. What an earlier `fly --out` left
/// there goes: two sets of results in one folder could not be told apart.
class FlightsFolder {
 public:
  /// Throws InputError where nothing can be made there.
  explicit FlightsFolder(const std::filesystem::path& out) : out_(out), staging_(out, "flights") {}

  /// Takes what was flown of a scenario, into a folder of its own below where `folder` names one. Sets
  /// `warning` as write_flown does.
  void add(const std::string& folder, const FlownScenario& flown, const FlightTask& task,
           std::string& warning);

  /// Puts all of it in its place, with `flights_json` as flights.json.
  void publish(const std::string& flights_json);

 private:
  std::filesystem::path out_;
  Staging staging_;
  std::vector<std::string> names_;
};

}  // namespace tunnelrig::cli
