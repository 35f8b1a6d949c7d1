// Tables and sweeps of other rigs: the measured speed is the speed, and each row gives a thrust coefficient.
#pragma once

#include "analysis/conventions.h"
#include "datasets/observations.h"

#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace tunnelrig {

inline constexpr double kNotKnown = std::numeric_limits<double>::quiet_NaN();

struct TableRow {
  std::size_t observation = 0;  // index in ObservationTable::rows
  std::string group;
  double speed_rpm = kNotKnown;
  double c_t = 0;
  std::string place;  // file and line
};

struct TableGroup {
  std::string name;
  std::vector<std::size_t> rows;  // indices in TableReduction::rows, by speed; those without one are last
  double lowest_speed_rpm = kNotKnown, highest_speed_rpm = kNotKnown;
  double median = 0;
  double spread = 0;  // 1.4826 times the median absolute deviation: σ of a normal scatter
  double at_lowest = kNotKnown, at_highest = kNotKnown;  // C_T at those speeds
};

struct TableReduction {
  std::string name;
  Convention convention = Convention::kPropeller;
  std::vector<TableRow> rows;
  std::vector<TableGroup> groups;  // in the order of the table
  std::size_t unknown = 0;         // rows left out because their speed or diameter is not known
  std::size_t at_rest = 0;         // rows left out because the motor stood, or its tachometer had not locked
  /// File and line of rows whose C_T is more than three times off their group's median.
  std::vector<std::string> doubtful;
};

/// C_T of every row: from its thrust, speed, diameter and air, or converted from the coefficient that the
/// table holds. Of one rotor. Of motors at rest, see resting_speed.h. Throws InputError where the response is
/// neither, or where no row can be reduced.
TableReduction reduce_table_rows(const ObservationTable& table, Convention convention);

std::string observations_csv(const TableReduction& reduction);
std::string table_reduction_json(const TableReduction& reduction);

/// Draws C_T against speed, a line for each group, by gnuplot (.svg or .png). The reason where it cannot.
std::optional<std::string> draw_coefficients(const TableReduction& reduction,
                                             const std::filesystem::path& picture);

}  // namespace tunnelrig
