// Every candidate effect, by what all of them must be.
#include "analysis/effects/effect.h"
#include "analysis/effects/expression_effect.h"
#include "datasets/csv.h"
#include "support/seeds.h"

#include <cmath>
#include <map>
#include <random>
#include <set>
#include <sstream>

#include <fmt/format.h>
#include <gmock/gmock.h>

namespace tunnelrig {
namespace {

/// Conditions that a rig meets, of every covariate that an effect names.
const std::map<std::string, std::pair<double, double>>& conditions() {
  static const std::map<std::string, std::pair<double, double>> ranges = {
      {"air_pressure_Pa", {90000, 108000}},
      {"air_temperature_C", {-20, 45}},
      {"air_temperature_rate_K_s", {-0.01, 0.01}},
      {"cell_temperature_C", {-10, 70}},
      {"relative_humidity", {0, 1}},
      {"speed_rpm", {1000, 9000}},
      {"supply_voltage_V", {6, 26}},
      {"tunnel_airspeed_m_s", {0, 8}},
      {"time_since_motor_start_s", {0, 5000}},
      {"hours_in_session", {0, 10}},
      {"run_order", {0, 500}},
      {"ground_distance_R", {0.8, 12}},
      {"ceiling_distance_R", {0.8, 12}},
      {"wall_distance_R", {0.3, 12}},
      {"excitation_voltage_V", {4.5, 5.5}},
      {"adc_reference_V", {3.1, 3.5}},
      {"clip_fraction", {0, 0.04}},
      {"mains_amplitude_V", {0, 0.05}},
      {"alias_amplitude_V", {0, 0.05}},
      {"vibration_amplitude_V", {0, 0.2}},
      {"tilt_deg", {0, 40}},
      {"cable_force_N", {-1, 1}}};
  return ranges;
}

/// A sample of an effect with memory of its own for what it looks at.
struct Situation {
  std::vector<double> x, reference;
  Rig rig;
  Sample sample;
  double force_N = 0;

  Situation(const Effect& effect, std::mt19937_64& random) {
    const auto draw = [&](double low, double high) {
      return std::uniform_real_distribution<double>(low, high)(random);
    };
    for (const std::string& name : effect.covariates) {
      const auto& [low, high] = conditions().at(name);
      x.push_back(draw(low, high));
      reference.push_back((low + high) / 2);
    }
    force_N = draw(3, 12);
    sample = {.x = x,
              .reference = reference,
              .time_s = draw(0, 120),
              .previous_N = draw(3, 12),
              .other_N = draw(3, 12),
              .newtons_per_volt = draw(2, 6),
              .rig = &rig};
  }
  Situation(const Situation&) = delete;
  Situation& operator=(const Situation&) = delete;
};

std::vector<double> draw_parameters(const Effect& effect, std::mt19937_64& random) {
  std::vector<double> parameters;
  for (const EffectParameter& p : effect.parameters) {
    const double upper = p.role == ParameterRole::kChangePoint ? 500 : p.upper;
    parameters.push_back(std::uniform_real_distribution<double>(p.lower, upper)(random));
  }
  return parameters;
}

std::string title(const Effect& effect) { return effect.name + " " + effect.form; }

TEST(Effects, AreExactlyTheNamesOfTheList) {
  std::set<std::string> names;
  for (const Effect& effect : all_effects()) names.insert(effect.name);
  EXPECT_THAT(names,
              testing::UnorderedElementsAre(
                  "air_pressure", "air_temperature", "air_humidity", "rotor_speed", "reynolds_number",
                  "tip_mach", "supply_voltage", "motor_warm_up", "wake_recirculation", "axial_wind",
                  "ground_effect", "ceiling_effect", "wall_effect", "blade_flex", "zero_drift_temperature",
                  "zero_drift_time", "span_drift_temperature", "temperature_gradient", "excitation_voltage",
                  "reference_drift", "creep", "creep_recovery", "hysteresis", "nonlinearity", "bidirectional",
                  "crosstalk", "axis_tilt", "cable_force", "mounting_step", "propeller_step", "mains_pickup",
                  "vibration_alias", "structural_resonance", "adc_clipping", "clock_lag", "zero_offset"));
}

TEST(Effects, AreDescribed) {
  std::set<std::string> titles;
  for (const Effect& effect : all_effects()) {
    SCOPED_TRACE(title(effect));
    EXPECT_TRUE(titles.insert(title(effect)).second) << "forms of one effect must differ in their name";
    EXPECT_THAT(effect.formula, testing::HasSubstr("F"));
    EXPECT_GT(effect.physics.size(), 15u);
    EXPECT_FALSE(effect.sign_rule.empty());
    for (const std::string& covariate : effect.covariates)
      EXPECT_TRUE(conditions().contains(covariate)) << covariate;
    ASSERT_FALSE(effect.parameters.empty());
    ASSERT_LE(effect.parameters.size(), std::size_t{kMaxEffectParameters});
    for (const EffectParameter& p : effect.parameters) {
      EXPECT_FALSE(p.name.empty());
      EXPECT_FALSE(p.unit.empty());
      EXPECT_LT(p.lower, p.upper);
    }
  }
}

TEST(Effects, BoundsHoldZeroTheoryAndTheGrid) {
  for (const Effect& effect : all_effects()) {
    SCOPED_TRACE(title(effect));
    const EffectParameter& amplitude = effect.parameters[0];
    EXPECT_EQ(amplitude.role, ParameterRole::kAmplitude);
    EXPECT_LE(amplitude.lower, 0);
    EXPECT_GT(amplitude.upper, 0);
    if (amplitude.theory) {
      EXPECT_GT(*amplitude.theory, amplitude.lower);
      EXPECT_LT(*amplitude.theory, amplitude.upper);
    }
    for (std::size_t k = 1; k < effect.parameters.size(); ++k) {
      const EffectParameter& p = effect.parameters[k];
      EXPECT_NE(p.role, ParameterRole::kAmplitude);
      if (p.role == ParameterRole::kShape) {
        EXPECT_GT(p.lower, 0);
        EXPECT_GE(p.grid.size(), 3u);
        EXPECT_TRUE(std::is_sorted(p.grid.begin(), p.grid.end()));
        EXPECT_GE(p.grid.front(), p.lower);
        EXPECT_LE(p.grid.back(), p.upper);
      }
    }
  }
}

TEST(Effects, AreAbsentAtAmplitudeZero) {
  std::mt19937_64 random(test::seed());
  for (const Effect& effect : all_effects()) {
    SCOPED_TRACE(title(effect));
    for (int i = 0; i < 200; ++i) {
      const Situation at(effect, random);
      std::vector<double> parameters = draw_parameters(effect, random);
      parameters[0] = 0;
      const double force = i % 2 == 0 ? at.force_N : -at.force_N;
      EXPECT_DOUBLE_EQ(effect.force_N(at.sample, parameters.data(), force), force);
    }
  }
}

TEST(Effects, AreFiniteOverBoundsAndConditions) {
  std::mt19937_64 random(test::seed() + 1);
  for (const Effect& effect : all_effects()) {
    SCOPED_TRACE(title(effect));
    for (int i = 0; i < 500; ++i) {
      const Situation at(effect, random);
      std::vector<double> parameters = draw_parameters(effect, random);
      if (i == 0) parameters[0] = effect.parameters[0].lower;
      if (i == 1) parameters[0] = effect.parameters[0].upper;
      EXPECT_TRUE(std::isfinite(effect.force_N(at.sample, parameters.data(), at.force_N)))
          << testing::PrintToString(at.x) << " at " << testing::PrintToString(parameters);
    }
  }
}

TEST(Effects, ImagesInGroundAndCeilingHaveNoPole) {
  for (const Effect& effect : all_effects()) {
    if (effect.form != "image") continue;
    SCOPED_TRACE(title(effect));
    const double strongest = effect.parameters[0].upper;
    for (int i = 2; i < 120; ++i) {
      const double distance_R = 0.05 * i;
      const std::vector<double> x = {distance_R};
      const double force_N = effect.force_N({.x = x, .reference = x}, &strongest, 1.0);
      EXPECT_GT(force_N, 1) << distance_R;
      EXPECT_LE(force_N, 4) << distance_R;
    }
  }
}

TEST(Effects, TheFirstRunHasNoPredecessor) {
  std::mt19937_64 random(test::seed() + 2);
  for (const Effect& effect : all_effects()) {
    if (!effect.needs_previous) continue;
    Situation at(effect, random);
    at.sample.previous_N = std::nan("");
    const std::vector<double> parameters = draw_parameters(effect, random);
    EXPECT_EQ(effect.force_N(at.sample, parameters.data(), at.force_N), at.force_N) << title(effect);
  }
}

TEST(Effects, DerivativesAreThoseOfTheFormula) {
  std::mt19937_64 random(test::seed() + 3);
  for (const Effect& effect : all_effects()) {
    SCOPED_TRACE(title(effect));
    for (int i = 0; i < 100; ++i) {
      const Situation at(effect, random);
      const std::vector<double> parameters = draw_parameters(effect, random);
      std::vector<EffectJet> jets;
      for (std::size_t k = 0; k < parameters.size(); ++k)
        jets.emplace_back(parameters[k], static_cast<int>(k));
      const EffectJet jet = effect.jet_N(at.sample, jets.data(), EffectJet(at.force_N));
      EXPECT_DOUBLE_EQ(jet.a, effect.force_N(at.sample, parameters.data(), at.force_N));
      for (std::size_t k = 0; k < parameters.size(); ++k) {
        if (effect.parameters[k].role == ParameterRole::kChangePoint) continue;
        const double range = effect.parameters[k].upper - effect.parameters[k].lower;
        const double step = 1e-5 * std::min(range, std::max(1e-3 * range, std::abs(parameters[k])));
        std::vector<double> above = parameters, below = parameters;
        above[k] += step;
        below[k] -= step;
        const double high = effect.force_N(at.sample, above.data(), at.force_N),
                     low = effect.force_N(at.sample, below.data(), at.force_N);
        const double derivative = jet.v[static_cast<Eigen::Index>(k)];
        // rounding of the difference, and a third derivative
        const double tolerance = 1e-5 * std::abs(derivative) + 1e-13 * std::abs(high) / step;
        EXPECT_NEAR((high - low) / (2 * step), derivative, tolerance)
            << effect.parameters[k].name << " " << testing::PrintToString(at.x) << " at "
            << testing::PrintToString(parameters);
      }
    }
  }
}

/// Lines of docs/effects.md.
std::vector<std::string> page() {
  std::vector<std::string> lines;
  std::istringstream text(read_text(TUNNELRIG_DOCS "/effects.md"));
  for (std::string line; std::getline(text, line);) lines.push_back(line);
  return lines;
}

TEST(Effects, StandInTheDocumentsWithFormulaBoundsAndCovariates) {
  const std::vector<std::string> lines = page();
  std::size_t found = 0;
  for (const Effect& effect : all_effects()) {
    SCOPED_TRACE(title(effect));
    const std::string form = effect.form.empty() ? "" : " (" + effect.form + ")";
    const std::string start = fmt::format("| `{}`{} | {} |", effect.name, form, effect.formula);
    const auto line = std::find_if(lines.begin(), lines.end(),
                                   [&](const std::string& text) { return text.starts_with(start); });
    ASSERT_NE(line, lines.end()) << "docs/effects.md has no line " << start;
    ++found;
    for (const EffectParameter& p : effect.parameters) {
      if (p.role == ParameterRole::kChangePoint) continue;
      const std::string unit = p.unit == "1" ? "" : " [" + p.unit + "]";
      const std::string theory = p.theory ? fmt::format(", theory {:g}", *p.theory) : "";
      EXPECT_THAT(*line, testing::HasSubstr(
                             fmt::format("{}{} {:g} … {:g}{}", p.name, unit, p.lower, p.upper, theory)));
    }
    for (const std::string& covariate : effect.covariates)
      EXPECT_THAT(*line, testing::HasSubstr("`" + covariate + "`"));
    EXPECT_THAT(*line, testing::HasSubstr(effect.physics));
  }
  const auto table_lines =
      static_cast<std::size_t>(std::count_if(lines.begin(), lines.end(), [](const std::string& line) {
        return line.starts_with("| `") && line.find(" | F ") != std::string::npos;
      }));
  EXPECT_EQ(table_lines, found) << "docs/effects.md has an effect that the program has not";
}

TEST(Effects, TheDocumentsExampleOfExpressionsIsRead) {
  std::string toml;
  bool within = false;
  for (const std::string& line : page()) {
    within = (within || line == "    [[effects]]") && (line.empty() || line.starts_with("    "));
    if (within) toml += line + "\n";
  }
  const std::vector<Effect> effects = parse_effects_toml(toml, "docs/effects.md");
  ASSERT_EQ(effects.size(), 2u);
  EXPECT_EQ(effects[1].parameters.size(), 2u);
}

}  // namespace
}  // namespace tunnelrig
