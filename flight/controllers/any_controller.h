// The controllers by name, and their gains from a file.
#pragma once

#include "flight/controllers/ibs_map.h"
#include "flight/controllers/ibs_observer.h"
#include "flight/controllers/indi.h"
#include "flight/controllers/pid.h"

#include <map>
#include <span>
#include <string>
#include <string_view>
#include <variant>

namespace tunnelrig {

struct ControllerKind {
  std::string_view name;
  std::string_view description;
  bool tuned = true;  // false: flies with the gains of its source
};

/// All of them, in the order of tables.
std::span<const ControllerKind> controller_kinds();

/// Gains by controller and name. A controller that is not in it has its struct's defaults.
using GainTable = std::map<std::string, std::map<std::string, double>, std::less<>>;

/// Parses a gain file (docs/flight.md). Throws InputError naming file, line and key for an unknown controller
/// or gain, a value that is no number, or one outside the gain's limits.
GainTable parse_gains(std::string_view text, const std::string& file);

/// The frozen gains of flight/tuning/gains.toml.
const GainTable& frozen_gains();

class AnyController {
 public:
  /// Throws InputError for a name that no controller has, listing those there are.
  AnyController(std::string_view name, const GainTable& gains, const ControllerContext& context);

  ControlOutput step(const ControlInput& in) {
    return std::visit([&](auto& controller) { return controller.step(in); }, controller_);
  }
  void reset() {
    std::visit([](auto& controller) { controller.reset(); }, controller_);
  }

  /// Pointers into this object.
  std::vector<NamedGain> gain_list();

 private:
  using Variant = std::variant<Ibs, IbsMap, IbsObserver, Indi, PidCascade, PidSingle>;
  static Variant make(std::string_view name, const ControllerContext& context);

  Variant controller_;
};

}  // namespace tunnelrig
