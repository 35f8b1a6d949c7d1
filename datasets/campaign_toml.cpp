#include <algorithm>
#include <cmath>
#include <numbers>

#define TOML_EXCEPTIONS 1
#include "datasets/campaign.h"
#include "datasets/error.h"

#include <fmt/ranges.h>
#include <toml++/toml.h>

namespace tunnelrig {
namespace {

constexpr std::string_view kFormat = "tunnelrig-campaign/1";

/// Typed access to one table of a document, with the file and line in every message. Remembers what was asked
/// for.
class Section {
 public:
  Section(const toml::table& document, std::string_view name, const std::string& file)
      : name_(name), file_(file) {
    const toml::node* node = document.get(name);
    if (node == nullptr) return;
    table_ = node->as_table();
    line_ = static_cast<int>(node->source().begin.line);
    if (table_ == nullptr) throw InputError::at(file_, line_, "{} is no table; write [{}]", name, name);
  }

  bool exists() const { return table_ != nullptr; }
  const std::string& name() const { return name_; }

  /// The number under `key`, which must lie in [lowest, highest] of `unit`; nothing where it is absent.
  std::optional<double> number(std::string_view key, double lowest, double highest, std::string_view unit) {
    known_.emplace_back(key);
    const toml::node* node = table_ != nullptr ? table_->get(key) : nullptr;
    if (node == nullptr) return {};
    const auto line = static_cast<int>(node->source().begin.line);
    const auto value = node->value<double>();
    if (!value || !std::isfinite(*value)) {
      throw InputError::at(file_, line, "{}.{} is not a number", name_, key);
    }
    if (*value < lowest || *value > highest) {
      throw InputError::at(file_, line, "{}.{} = {:g}: must lie between {:g} and {:g} {}", name_, key, *value,
                           lowest, highest, unit);
    }
    return value;
  }

  /// The same, where only a whole number has a meaning.
  std::optional<int> whole(std::string_view key, int lowest, int highest, std::string_view unit) {
    const auto value = number(key, lowest, highest, unit);
    if (!value) return {};
    if (*value != std::round(*value))
      throw InputError::at(file_, static_cast<int>(table_->get(key)->source().begin.line),
                           "{}.{} = {:g}: must be a whole number", name_, key, *value);
    return static_cast<int>(*value);
  }

  double required(std::string_view key, double lowest, double highest, std::string_view unit) {
    if (const auto value = number(key, lowest, highest, unit)) return *value;
    throw InputError::at(file_, line_, "{}.{} [{}] is required", name_, key, unit);
  }

  /// Keys that nobody has asked for, a sentence each.
  void tell_unread(std::vector<std::string>& unread) const {
    if (table_ == nullptr) return;
    for (const auto& [key, value] : *table_)
      if (std::find(known_.begin(), known_.end(), key.str()) == known_.end())
        unread.push_back(fmt::format("{}:{}: nothing reads {}.{}; known are {}", file_,
                                     key.source().begin.line, name_, key.str(), fmt::join(known_, ", ")));
  }

 private:
  const toml::table* table_ = nullptr;
  std::string name_;
  std::vector<std::string> known_;
  const std::string& file_;
  int line_ = 1;
};

toml::table parse_document(const std::string& text, const std::string& file) {
  try {
    return toml::parse(text, file);
  } catch (const toml::parse_error& error) {
    throw InputError::at(file, static_cast<int>(error.source().begin.line), "{}", error.description());
  }
}

Rig parse_rig(Section& section) {
  Rig rig;
  rig.rotors = section.whole("rotors", 1, kMaxRotors, "rotors").value_or(kMaxRotors);
  rig.propeller_radius_m = section.required("propeller_radius_m", 0.005, 5, "m");
  const double disc = std::numbers::pi * rig.propeller_radius_m * rig.propeller_radius_m;
  rig.rotor_area_m2 = section.number("rotor_area_m2", 1e-5, 400, "m²").value_or(disc);
  rig.nominal_speed_rpm = section.required("nominal_speed_rpm", 1, 200000, "rev/min");
  rig.arm_length_m = section.number("arm_length_m", 0, 50, "m").value_or(0);
  rig.vehicle_width_m = section.number("vehicle_width_m", 0, 100, "m").value_or(0);
  rig.vehicle_height_m = section.number("vehicle_height_m", 0, 100, "m").value_or(0);
  rig.blades = section.whole("blades", 1, 16, "blades").value_or(rig.blades);
  rig.cell_limit_N = section.number("cell_limit_N", 0.001, 1e6, "N").value_or(rig.cell_limit_N);
  rig.blade_chord_m = section.number("blade_chord_m", 1e-4, 2, "m").value_or(0);
  return rig;
}

Tunnel parse_tunnel(Section& section, const Rig& rig, const std::string& file) {
  const Tunnel tunnel{section.required("width_m", 0.05, 1000, "m"),
                      section.required("height_m", 0.05, 1000, "m")};
  if (tunnel.width_m <= rig.vehicle_width_m || tunnel.height_m <= rig.vehicle_height_m) {
    throw InputError::in(file, "the vehicle ({} × {} m) does not fit the tunnel ({} × {} m)",
                         rig.vehicle_width_m, rig.vehicle_height_m, tunnel.width_m, tunnel.height_m);
  }
  return tunnel;
}

Daq parse_daq(Section& section) {
  Daq daq;
  daq.sample_rate_hz = section.number("sample_rate_hz", 1, 1e6, "Hz").value_or(daq.sample_rate_hz);
  daq.adc_bits = section.whole("adc_bits", 1, 16, "bits").value_or(daq.adc_bits);
  daq.adc_reference_V = section.number("adc_reference_V", 0.01, 100, "V").value_or(daq.adc_reference_V);
  daq.mains_hz = section.number("mains_hz", 1, 1000, "Hz");
  return daq;
}

/// Tables and keys of tables that nothing reads; keys outside of tables are free text about the campaign.
std::vector<std::string> unread_keys(const toml::table& document,
                                     std::initializer_list<const Section*> sections,
                                     const std::string& file) {
  std::vector<std::string> unread;
  for (const auto& [key, node] : document) {
    if (!node.is_table()) continue;
    const std::string_view name = key.str();
    const auto section = std::find_if(sections.begin(), sections.end(),
                                      [name](const Section* s) { return s->name() == name; });
    if (section != sections.end())
      (*section)->tell_unread(unread);
    else
      unread.push_back(fmt::format("{}:{}: nothing reads [{}]", file, key.source().begin.line, name));
  }
  return unread;
}

}  // namespace

double Daq::volts_per_count() const { return std::ldexp(adc_reference_V, -adc_bits); }
int Daq::highest_count() const { return (1 << adc_bits) - 1; }

CampaignInfo parse_campaign_toml(const std::string& text, const std::string& file) {
  const toml::table document = parse_document(text, file);
  const auto format = document["format"].value<std::string>();
  if (!format) throw InputError::at(file, 1, "the key format is required (format = \"{}\")", kFormat);
  if (*format != kFormat) {
    throw InputError::at(file, static_cast<int>(document["format"].node()->source().begin.line),
                         "format is \"{}\"; this program reads \"{}\"", *format, kFormat);
  }
  CampaignInfo info;
  info.toml = text;
  info.name = document["name"].value<std::string>().value_or("");
  Section rig(document, "rig", file), tunnel(document, "tunnel", file), daq(document, "daq", file),
      uncertainty(document, "uncertainty", file);
  if (!rig.exists()) throw InputError::at(file, 1, "the table [rig] is required");
  info.rig = parse_rig(rig);
  if (tunnel.exists()) info.tunnel = parse_tunnel(tunnel, info.rig, file);
  info.daq = parse_daq(daq);
  info.uncertainty = {.speed_rpm = uncertainty.number("speed_rpm", 0, 10000, "rev/min"),
                      .air_temperature_K = uncertainty.number("air_temperature_K", 0, 100, "K"),
                      .air_pressure_Pa = uncertainty.number("air_pressure_Pa", 0, 50000, "Pa"),
                      .force_N = uncertainty.number("force_N", 0, 1000, "N")};
  info.unread = unread_keys(document, {&rig, &tunnel, &daq, &uncertainty}, file);
  return info;
}

std::string reference_campaign_toml() {
  return R"(format = "tunnelrig-campaign/1"
name = "static thrust in the 1.5 m tunnel"

[rig]
propeller_radius_m = 0.1524   # HQProp 12x6
arm_length_m = 0.31           # R_q
vehicle_width_m = 0.743       # w_q, tip to tip: 2 (0.31 cos 45 deg + 0.1524)
vehicle_height_m = 0.30       # h_q
nominal_speed_rpm = 5000.0
blade_chord_m = 0.025         # at 0.5 R

[tunnel]
width_m = 1.5
height_m = 1.5

[daq]
sample_rate_hz = 1333.3333333333333
adc_bits = 12
adc_reference_V = 3.3
)";
}

}  // namespace tunnelrig
