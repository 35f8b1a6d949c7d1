// One campaign of the benchmark: its key, and what `explain` wrote about it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace tunnelrig::attribution {

struct TrueParameter {
  std::string name, unit;
  double value = 0;
};

struct TrueEffect {
  std::string name, level;
  std::vector<std::string> covariates;
  std::vector<TrueParameter> parameters;
};

struct Key {
  std::string track, noise, order;
  double size = 0;
  int blocks = 0;
  bool raw = false;
  std::vector<TrueEffect> effects;
  std::vector<std::string> acceptable;
  double floor_N = 0;       // held-out error to expect of an exact mean model, coefficients estimated
  double floor_root_N = 0;  // the same with coefficients known
};

struct FoundParameter {
  std::string name, unit;
  double value = 0, low = 0, high = 0;
};

struct FoundEffect {
  std::string name;
  std::vector<std::string> confounded_with;
  std::vector<FoundParameter> parameters;
  bool has_separating_run = false;

  bool set_contains(const std::string& effect) const;
};

/// The contract of `explain --json`, as far as it is scored.
struct Explanation {
  std::string verdict;
  double noise_floor_N = 0, held_out_N = 0, held_out_low_N = 0, held_out_high_N = 0;
  std::vector<FoundEffect> adopted;
  std::vector<std::string> unknown_covariates;
  std::vector<std::string> broken_rules;  // of the contract: keys that lack, numbers that are none
};

struct Outcome {
  Key key;
  std::optional<Explanation> explanation;  // nothing where `explain` failed
  std::optional<Explanation> separated;    // after the proposed runs were made
  double seconds = 0;
};

/// Throws InputError where the key is not one.
Key parse_key(const nlohmann::json& json);

/// Never throws: what is missing or of the wrong kind is listed in `broken_rules`.
Explanation parse_explanation(const nlohmann::json& json);

/// One line of the results: {"key": …, "explain": … or null, "separated": … or null, "seconds": …}.
/// Throws InputError naming `where`.
Outcome parse_outcome(const std::string& line, const std::string& where);

}  // namespace tunnelrig::attribution
