#include "calibration/certificate.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include <fmt/format.h>

namespace tunnelrig {
namespace {

constexpr int kLabel = 34, kColumn = 20;

/// A line of the table: what it shows of a cell, "-" where there is nothing to show.
struct TableLine {
  std::string label;
  std::function<std::string(const CellFit&)> cell;
};

const char* name_of(RobustLoss loss) {
  switch (loss) {
    case RobustLoss::kOrdinary:
      return "least squares";
    case RobustLoss::kHuber:
      return "Huber";
    case RobustLoss::kCauchy:
      return "Cauchy";
    case RobustLoss::kTukey:
      return "Tukey";
  }
  return "";
}

template <typename T, typename Show>
std::string shown(const std::optional<T>& value, Show show) {
  return value ? show(*value) : "-";
}

bool passed(const Certificate& certificate, int cell) {
  return std::all_of(certificate.gates.begin(), certificate.gates.end(),
                     [cell](const CalibrationGate& gate) { return gate.cell != cell || gate.passed; });
}

std::vector<TableLine> fit_lines(const std::string& level) {
  return {
      {"points used / given",
       [](const CellFit& fit) { return fmt::format("{} / {}", fit.points_used(), fit.points.size()); }},
      {"range, N",
       [](const CellFit& fit) {
         return fmt::format("{:.3f} to {:.3f}", fit.lowest_force_N, fit.highest_force_N);
       }},
      {"zero, V", [](const CellFit& fit) { return fmt::format("{:.6f}", fit.zero_V); }},
      {"  U" + level + ", V", [](const CellFit& fit) { return fmt::format("{:.6f}", fit.zero_u95_V()); }},
      {"gain, V/N", [](const CellFit& fit) { return fmt::format("{:.6f}", fit.gain_V_per_N); }},
      {"  U" + level + ", V/N",
       [](const CellFit& fit) { return fmt::format("{:.6f}", fit.gain_u95_V_per_N()); }},
      {"degrees of freedom", [](const CellFit& fit) { return fmt::format("{:.1f}", fit.dof); }},
      {"correlation", [](const CellFit& fit) { return fmt::format("{:.6f}", fit.correlation); }},
      {"residual std, N", [](const CellFit& fit) { return fmt::format("{:.4f}", fit.residual_std_N()); }},
  };
}

std::vector<TableLine> check_lines() {
  return {
      {"lack of fit, p",
       [](const CellFit& fit) {
         return shown(fit.checks.lack_of_fit,
                      [](const auto& check) { return fmt::format("{:.2g}", check.p); });
       }},
      {"linearity, N (% of span)",
       [](const CellFit& fit) {
         return shown(fit.checks.linearity, [](const auto& check) {
           return fmt::format("{:.4f} ({:.2f})", check.max_deviation_N, check.max_deviation_percent_of_span);
         });
       }},
      {"  quadratic term, p",
       [](const CellFit& fit) {
         return shown(fit.checks.linearity, [](const auto& check) { return fmt::format("{:.2g}", check.p); });
       }},
      {"hysteresis, N (% of span)",
       [](const CellFit& fit) {
         return shown(fit.checks.hysteresis, [](const auto& check) {
           return fmt::format("{:+.4f} ({:.2f})", check.largest_N.value_or(check.down_minus_up_N),
                              check.percent_of_span);
         });
       }},
      {"repeatability, N",
       [](const CellFit& fit) {
         return shown(fit.checks.repeatability,
                      [](const auto& check) { return fmt::format("{:.4f}", check.std_N); });
       }},
      {"zero return, N (% of span)",
       [](const CellFit& fit) {
         return shown(fit.checks.zero_return, [](const auto& check) {
           return fmt::format("{:+.4f} ({:.2f})", check.change_N, check.percent_of_span);
         });
       }},
      {"creep, N",
       [](const CellFit& fit) {
         return shown(fit.checks.creep,
                      [](const auto& check) { return fmt::format("{:+.4f}", check.largest_N); });
       }},
  };
}

/// The checks that no cell's points allow, and what they would take.
std::string untested(const Certificate& certificate) {
  const auto none = [&](auto has) {
    for (const CellFit& fit : certificate.cells) {
      if (has(fit.checks)) return false;
    }
    return true;
  };
  std::string text;
  const auto add = [&](bool absent, const char* what) {
    if (absent) text += fmt::format("  {}\n", what);
  };
  add(none([](const CellChecks& c) { return c.lack_of_fit.has_value(); }),
      "lack of fit and repeatability: no force was applied twice in one direction");
  add(none([](const CellChecks& c) { return c.linearity.has_value(); }),
      "linearity: it takes four points at three forces");
  add(none([](const CellChecks& c) { return c.hysteresis.has_value(); }),
      "hysteresis: the points do not all say whether the load went up or down, twice each");
  add(none([](const CellChecks& c) { return c.zero_return.has_value(); }),
      "zero return: no zero force before and after load, in a known sequence");
  add(none([](const CellChecks& c) { return c.creep.has_value(); }),
      "creep: no force was read twice running, in a known sequence");
  return text.empty() ? text : "\nNot tested, because the points do not allow it (-)\n" + text;
}

std::string point_table(const Certificate& certificate) {
  std::string text;
  for (const CellFit& fit : certificate.cells) {
    for (const CellPoint& point : fit.points) {
      if (!point.suspicious && !point.gross) continue;
      text +=
          fmt::format("  {:>4} {:>6} {:>10.4f} {:>10.6f} {:>12.4f} {:>12.2f} {:>10.2g}  {}\n", fit.cell,
                      point.line, point.force_N, point.voltage_V, point.residual_N, point.studentised,
                      point.p, point.weight == 0 ? "left out" : fmt::format("weight {:.2f}", point.weight));
    }
  }
  if (text.empty()) return "\nNo suspicious points.\n";
  return fmt::format("\nSuspicious points\n  {:>4} {:>6} {:>10} {:>10} {:>12} {:>12} {:>10}\n{}", "cell",
                     "line", "force, N", "volts", "residual, N", "studentised", "p", text);
}

std::string propeller_table(const PropellerFactors& propellers) {
  if (!propellers.tested) return "\nPropellers: not tested, every factor is 1.\n";
  std::string text = fmt::format("\nPropellers\n  {:>5}  {:<20} {:>7} {:>9} {:>12}\n", "rotor", "propeller",
                                 "repeats", "factor", "std. uncert.");
  for (Eigen::Index i = 0; i < propellers.factor.size(); ++i) {
    const auto rotor = static_cast<std::size_t>(i);
    text += fmt::format("  {:>5}  {:<20} {:>7} {:>9.5f} {:>12}\n", i + 1, propellers.propellers[rotor],
                        propellers.repeats[rotor], propellers.factor[i],
                        propellers.uncertainty_known()
                            ? fmt::format("{:.5f}", std::sqrt(propellers.covariance(i, i)))
                            : "unknown");
  }
  return text;
}

std::string heading(const Certificate& certificate) {
  const CalibrationConditions& conditions = certificate.conditions;
  const std::string warnings =
      certificate.warnings.empty() ? "" : fmt::format(", with {} warning(s)", certificate.warnings.size());
  std::string text =
      fmt::format("Calibration certificate: {}{}\n  made from {} points and {} propeller tests, {}\n",
                  certificate.passed() ? "PASSED" : "FAILED", warnings, conditions.points,
                  conditions.propeller_tests, certificate.points_hash);
  if (conditions.lowest_air_temperature_C) {
    text += fmt::format("  air temperature {:.1f} to {:.1f} °C\n", *conditions.lowest_air_temperature_C,
                        *conditions.highest_air_temperature_C);
  }
  if (!certificate.cells.empty()) {
    const CellFit& fit = certificate.cells.front();
    text += fmt::format("  voltage = zero + gain · force by {}", name_of(fit.loss));
    text += fit.gauge_force_N > 0
                ? fmt::format(", force gauge with a standard uncertainty of {:g} N\n", fit.gauge_force_N)
                : std::string(", force gauge taken as exact\n");
  }
  return text;
}

}  // namespace

std::string format_certificate(const Certificate& certificate) {
  std::string text = heading(certificate) + '\n';
  const auto line = [&](const TableLine& of) {
    text += fmt::format("  {:<{}}", of.label, kLabel);
    for (const CellFit& fit : certificate.cells) text += fmt::format("{:>{}}", of.cell(fit), kColumn);
    text += '\n';
  };
  const double confidence = certificate.cells.empty() ? 0.95 : certificate.cells.front().confidence;
  line({"", [](const CellFit& fit) { return fmt::format("cell {}", fit.cell); }});
  for (const TableLine& of : fit_lines(fmt::format("{:g}", 100 * confidence))) line(of);
  for (const TableLine& of : check_lines()) line(of);
  line({"verdict", [&](const CellFit& fit) { return passed(certificate, fit.cell) ? "passed" : "FAILED"; }});
  for (const CalibrationGate& gate : certificate.gates) {
    if (gate.passed) continue;
    text += fmt::format("\n  FAILED: cell {}, {}: {}", gate.cell, gate.name, gate.finding);
  }
  text += untested(certificate) + point_table(certificate) + propeller_table(certificate.propellers);
  if (!certificate.warnings.empty()) text += "\nWarnings\n";
  for (const std::string& warning : certificate.warnings) text += fmt::format("  {}\n", warning);
  return text;
}

}  // namespace tunnelrig
