#include "calibration/certificate.h"

#include "datasets/error.h"
#include "datasets/first_few.h"

#include <algorithm>
#include <cmath>

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace tunnelrig {
namespace {

/// Collects the gates of one cell.
class Gatekeeper {
 public:
  Gatekeeper(const CellFit& fit, const CalibrationLimits& limits, std::vector<CalibrationGate>& gates)
      : fit_(fit), limits_(limits), gates_(gates) {}

  void check_all() {
    add("convergence", fit_.convergence.converged, fit_.convergence.message);
    add("correlation", std::abs(fit_.correlation) > limits_.correlation,
        "{:.5f}, must be above {:g} (thesis 4.2.1.1)", std::abs(fit_.correlation), limits_.correlation);
    const double residual = 100 * fit_.residual_std_N() / fit_.span_N();
    add("residual scatter", residual <= limits_.residual_percent_of_span,
        "{:.2f} % of span, may be at most {:g} %", residual, limits_.residual_percent_of_span);
    check_middle();
    check_shape();
    check_changes();
  }

 private:
  template <typename... Args>
  void add(const char* name, bool passed, fmt::format_string<Args...> finding, Args&&... args) {
    gates_.push_back({fit_.cell, name, passed, fmt::format(finding, std::forward<Args>(args)...)});
  }
  void add(const char* name, bool passed, const std::string& finding) {
    gates_.push_back({fit_.cell, name, passed, finding});
  }

  void check_middle() {
    const double middle = (fit_.lowest_force_N + fit_.highest_force_N) / 2;
    const ForcePrediction there = predict_force(fit_, fit_.zero_V + fit_.gain_V_per_N * middle);
    const double u95 = (there.upper_N - there.lower_N) / 2;
    // against the largest force: a cell that is loaded both ways has its middle at zero
    const double size = std::max(std::abs(fit_.lowest_force_N), std::abs(fit_.highest_force_N));
    add("force uncertainty", 100 * u95 / size <= limits_.force_u95_percent,
        "{:.3f} % of the largest force at {:.3g} N, may be at most {:g} %", 100 * u95 / size, middle,
        limits_.force_u95_percent);
  }

  void check_shape() {
    const CellChecks& checks = fit_.checks;
    if (checks.lack_of_fit) {
      // Of two forces only, loaded and unloaded, there is no line to be off from, and p decides alone.
      const bool small = checks.linearity &&
                         checks.linearity->max_deviation_percent_of_span <= limits_.effect_percent_of_span;
      add("lack of fit", checks.lack_of_fit->p >= limits_.test_p || small, "F = {:.3g}, p = {:.2g}{}",
          checks.lack_of_fit->f, checks.lack_of_fit->p,
          checks.linearity
              ? fmt::format(", up to {:.2f} % of span", checks.linearity->max_deviation_percent_of_span)
              : "");
    }
    if (checks.linearity) {
      const double bow = 100 * checks.linearity->bow_N / fit_.span_N();
      add("linearity", checks.linearity->p >= limits_.test_p || bow <= limits_.effect_percent_of_span,
          "bow {:.2f} % of span, p = {:.2g}", bow, checks.linearity->p);
    }
    if (checks.hysteresis) {
      const Hysteresis& hysteresis = *checks.hysteresis;
      add("hysteresis",
          hysteresis.p >= limits_.test_p || hysteresis.percent_of_span <= limits_.effect_percent_of_span,
          "{:.2f} % of span, p = {:.2g}", hysteresis.percent_of_span, hysteresis.p);
    }
  }

  void check_changes() {
    const CellChecks& checks = fit_.checks;
    if (checks.zero_return) {
      add("zero return", checks.zero_return->percent_of_span <= limits_.change_percent_of_span,
          "{:.2f} % of span, may be at most {:g} %", checks.zero_return->percent_of_span,
          limits_.change_percent_of_span);
    }
    if (checks.creep) {
      const double creep = 100 * std::abs(checks.creep->largest_N) / fit_.span_N();
      add("creep", creep <= limits_.change_percent_of_span, "{:.2f} % of span, may be at most {:g} %", creep,
          limits_.change_percent_of_span);
    }
  }

  const CellFit& fit_;
  const CalibrationLimits& limits_;
  std::vector<CalibrationGate>& gates_;
};

void warn_of_cell(const CellFit& fit, std::vector<std::string>& warnings) {
  const auto n = static_cast<double>(fit.points.size());
  for (const CellPoint& point : fit.points) {
    if (point.gross) {
      warnings.push_back(
          fmt::format("cell {}: the point of line {} ({:g} N, {:g} V) is {:+.3g} N off the line of the "
                      "others (p = {:.1g}) "
                      "and {}",
                      fit.cell, point.line, point.force_N, point.voltage_V, point.residual_N, point.p,
                      point.weight == 0 ? "has been left out" : "has been kept; take it again"));
    } else if (point.suspicious) {
      warnings.push_back(fmt::format("cell {}: the point of line {} ({:g} N) is suspicious (p = {:.2g})",
                                     fit.cell, point.line, point.force_N, point.p));
    }
    if (point.weight > 0 && point.leverage > std::max(0.5, 4 / n)) {
      warnings.push_back(
          fmt::format("cell {}: the line hangs on the point of line {} ({:g} N), whose leverage is {:.2f}; "
                      "take more points near that force",
                      fit.cell, point.line, point.force_N, point.leverage));
    }
  }
}

void warn_of_zeros(const std::vector<CellFit>& cells, std::vector<std::string>& warnings) {
  std::vector<int> extrapolated;
  for (const CellFit& fit : cells) {
    if (fit.lowest_force_N > 0 || fit.highest_force_N < 0) extrapolated.push_back(fit.cell);
  }
  if (extrapolated.empty()) return;
  warnings.push_back(fmt::format(
      "cell {}: no force near zero was applied, so the zero is extrapolated (see its U); runs of sessions "
      "without tare carry that uncertainty",
      fmt::join(extrapolated, ", ")));
}

void warn_of_propellers(const PropellerFactors& propellers, std::vector<std::string>& warnings) {
  if (!propellers.tested) {
    warnings.emplace_back("no propeller tests: every propeller factor is 1, without uncertainty");
  } else if (!propellers.uncertainty_known()) {
    warnings.emplace_back(
        "no propeller was tested twice: the uncertainty of the propeller factors is not known and left out");
  }
}

double median_without(const std::vector<PropellerTest>& tests, std::size_t left_out) {
  std::vector<double> thrusts_N;
  for (std::size_t i = 0; i < tests.size(); ++i)
    if (i != left_out) thrusts_N.push_back(tests[i].thrust_N);
  std::sort(thrusts_N.begin(), thrusts_N.end());
  const std::size_t middle = thrusts_N.size() / 2;
  return thrusts_N.size() % 2 == 1 ? thrusts_N[middle] : (thrusts_N[middle - 1] + thrusts_N[middle]) / 2;
}

/// One motor turns propellers of one size in all tests: their thrusts are within some per cent.
void warn_of_odd_tests(const std::vector<PropellerTest>& tests, std::vector<std::string>& warnings) {
  constexpr double kOdd = 2;
  constexpr std::size_t kNamed = 3;
  std::vector<std::string> odd;
  for (std::size_t i = 0; tests.size() > 1 && i < tests.size(); ++i) {
    const double median_N = median_without(tests, i), ratio = tests[i].thrust_N / median_N;
    if (ratio <= kOdd && ratio >= 1 / kOdd) continue;
    odd.push_back(
        fmt::format("line {} (propeller {} on rotor {}) has {:g} N where the median of the others is "
                    "{:.4g} N",
                    tests[i].line, tests[i].propeller, tests[i].rotor, tests[i].thrust_N, median_N));
  }
  if (odd.empty()) return;
  warnings.push_back(
      fmt::format("propeller tests: {}; are these newtons (not grams)? Every propeller factor "
                  "depends on all tests",
                  first_few(odd, kNamed)));
}

CalibrationConditions conditions_of(const std::vector<CalibrationPoint>& points,
                                    const std::vector<PropellerTest>& tests) {
  CalibrationConditions conditions{.points = static_cast<int>(points.size()),
                                   .propeller_tests = static_cast<int>(tests.size())};
  for (const CalibrationPoint& point : points) {
    if (!point.air_temperature_C) continue;
    const double here = *point.air_temperature_C;
    conditions.lowest_air_temperature_C = std::min(here, conditions.lowest_air_temperature_C.value_or(here));
    conditions.highest_air_temperature_C =
        std::max(here, conditions.highest_air_temperature_C.value_or(here));
  }
  return conditions;
}

}  // namespace

bool Certificate::passed() const {
  return std::all_of(gates.begin(), gates.end(), [](const CalibrationGate& gate) { return gate.passed; });
}

ForceReading Certificate::force(int cell, double voltage_V, std::optional<double> tare_V) const {
  const CellFit& fit = cells.at(static_cast<std::size_t>(cell - 1));
  const double per_volt = 1 / fit.gain_V_per_N;
  ForceReading reading;
  reading.force_N = (voltage_V - tare_V.value_or(fit.zero_V)) * per_volt;
  reading.d_voltage_N_per_V = per_volt;
  (tare_V ? reading.d_tare_N_per_V : reading.d_zero_N_per_V) = -per_volt;
  reading.d_gain_N2_per_V = -reading.force_N * per_volt;
  reading.zero_from_calibration = !tare_V;
  reading.extrapolated = reading.force_N < fit.lowest_force_N || reading.force_N > fit.highest_force_N;
  return reading;
}

Certificate calibrate(const std::vector<CalibrationPoint>& points, const std::vector<PropellerTest>& tests,
                      const CalibrationOptions& options) {
  for (const CalibrationPoint& point : points) {
    if (point.cell >= 1 && point.cell <= options.rotors) continue;
    throw InputError::at("calibration.csv", point.line, "cell {} is none of 1 to {}", point.cell,
                         options.rotors);
  }
  Certificate certificate{.conditions = conditions_of(points, tests), .points_hash = hash_of(points, tests)};
  for (int cell = 1; cell <= options.rotors; ++cell) {
    std::vector<CalibrationPoint> own;
    std::copy_if(points.begin(), points.end(), std::back_inserter(own),
                 [cell](const CalibrationPoint& point) { return point.cell == cell; });
    if (own.empty()) throw InputError::in("calibration.csv", "cell {} has no points", cell);
    const CellFit& fit = certificate.cells.emplace_back(fit_load_cell(own, options.cell));
    Gatekeeper(fit, options.limits, certificate.gates).check_all();
    warn_of_cell(fit, certificate.warnings);
  }
  warn_of_zeros(certificate.cells, certificate.warnings);
  certificate.propellers = propeller_factors(tests, options.rotors);
  warn_of_propellers(certificate.propellers, certificate.warnings);
  warn_of_odd_tests(tests, certificate.warnings);
  return certificate;
}

std::string hash_of(const std::vector<CalibrationPoint>& points, const std::vector<PropellerTest>& tests) {
  std::string text;
  for (const CalibrationPoint& point : points) {
    text += fmt::format("{},{},{},{},{},{}\n", point.cell, point.applied_force_N, point.voltage_V,
                        point.sequence ? fmt::format("{}", *point.sequence) : "", point.direction,
                        point.air_temperature_C ? fmt::format("{}", *point.air_temperature_C) : "");
  }
  for (const PropellerTest& test : tests) {
    text += fmt::format("{},{},{},{}\n", test.propeller, test.rotor, test.direction, test.thrust_N);
  }
  const XXH128_hash_t hash = XXH3_128bits(text.data(), text.size());
  return fmt::format("xxh3:{:016x}{:016x}", hash.high64, hash.low64);
}

}  // namespace tunnelrig
