#include "flight/controllers/any_controller.h"

#include "datasets/error.h"
#include "flight/frozen_gains.h"

#include <array>
#include <cmath>

#include <fmt/ranges.h>

#define TOML_EXCEPTIONS 1
#include <toml++/toml.h>

namespace tunnelrig {
namespace {

constexpr std::array<ControllerKind, 11> kKinds = {{
    {"ibs", "integral backstepping as printed, (6.29) and (6.30)"},
    {"ibs-lyapunov", "integral backstepping with a1 = 1 + k1 + k2 k3"},
    {"pid", "ArduCopter's position cascade without feed-forward"},
    {"pid-ff", "ArduCopter's position cascade with its feed-forward of velocity and acceleration"},
    {"pid-single", "the thesis's lateral PID (6.16) with ArduCopter's altitude hold"},
    {"ibs-map", "ibs-lyapunov with the measured map fed forward"},
    {"ibs-do", "backstepping with a disturbance observer"},
    {"indi", "incremental nonlinear dynamic inversion"},
    {"ibs-map-off", "ibs-map with its gains and without its map", false},
    {"pid-stock", "as pid, with ArduCopter 4's gains", false},
    {"pid-ff-stock", "as pid-ff, with ArduCopter 4's gains", false},
}};

}  // namespace

std::span<const ControllerKind> controller_kinds() { return kKinds; }

AnyController::Variant AnyController::make(std::string_view name, const ControllerContext& context) {
  const double full = context.full_thrust_m_s2;
  if (name == "ibs") return Ibs(IbsForm::kPrinted, {});
  if (name == "ibs-lyapunov") return Ibs(IbsForm::kLyapunov, {});
  if (name == "ibs-map") return IbsMap({}, context);
  if (name == "ibs-map-off") {
    ControllerContext without = context;
    without.map = nullptr;
    return IbsMap({}, without);
  }
  if (name == "ibs-do") return IbsObserver({});
  if (name == "indi") return Indi({});
  if (name == "pid" || name == "pid-stock") return PidCascade({}, {}, full, false);
  if (name == "pid-ff" || name == "pid-ff-stock") return PidCascade({}, {}, full, true);
  if (name == "pid-single") return PidSingle({}, {}, full);
  std::vector<std::string_view> names;
  for (const ControllerKind& kind : kKinds) names.push_back(kind.name);
  throw InputError(fmt::format("no controller is called '{}'; there are {}", name, fmt::join(names, ", ")));
}

AnyController::AnyController(std::string_view name, const GainTable& gains, const ControllerContext& context)
    : controller_(make(name, context)) {
  const auto table = gains.find(name == "ibs-map-off" ? "ibs-map" : name);
  if (table == gains.end()) return;
  for (const NamedGain& gain : gain_list()) {
    const auto value = table->second.find(std::string(gain.name));
    if (value != table->second.end()) *gain.value = value->second;
  }
}

std::vector<NamedGain> AnyController::gain_list() {
  return std::visit([](auto& controller) { return controller.gain_list(); }, controller_);
}

GainTable parse_gains(std::string_view text, const std::string& file) {
  toml::table document;
  try {
    document = toml::parse(text, file);
  } catch (const toml::parse_error& error) {
    throw InputError::at(file, static_cast<int>(error.source().begin.line), "{}", error.description());
  }
  const auto line_of = [](const toml::node& node) { return static_cast<int>(node.source().begin.line); };
  if (document["format"].value_or(std::string()) != "tunnelrig-gains/1")
    throw InputError::in(file, "must say format = \"tunnelrig-gains/1\"");
  GainTable gains;
  for (const auto& [key, node] : document) {
    const std::string name(key.str());
    if (name == "format") continue;
    const toml::table* table = node.as_table();
    if (table == nullptr) throw InputError::at(file, line_of(node), "{} is no table; write [{}]", name, name);
    const auto kind =
        std::find_if(kKinds.begin(), kKinds.end(), [&](const auto& k) { return k.name == name; });
    if (kind != kKinds.end() && !kind->tuned)
      throw InputError::at(file, line_of(node), "{} has no gains of its own: {}", name, kind->description);
    AnyController controller = [&, line = line_of(node)] {
      try {
        return AnyController(name, {}, {});
      } catch (const InputError& error) {
        throw InputError::at(file, line, "{}", error.what());
      }
    }();
    const auto known = controller.gain_list();
    for (const auto& [gain_key, value_node] : *table) {
      const auto gain =
          std::find_if(known.begin(), known.end(),
                       [wanted = gain_key.str()](const NamedGain& g) { return g.name == wanted; });
      if (gain == known.end())
        throw InputError::at(file, line_of(value_node), "{} has no gain {}", name, gain_key.str());
      const auto value = value_node.value<double>();
      if (!value || !(*value >= gain->lowest && *value <= gain->highest))
        throw InputError::at(file, line_of(value_node), "{}.{} must be a number from {:g} to {:g}", name,
                             gain->name, gain->lowest, gain->highest);
      gains[name][std::string(gain->name)] = *value;
    }
  }
  return gains;
}

const GainTable& frozen_gains() {
  static const GainTable table = parse_gains(kFrozenGains, "flight/tuning/gains.toml");
  return table;
}

}  // namespace tunnelrig
