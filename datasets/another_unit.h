// Part of a column that is written in another unit than the rest: the rule.
#pragma once

#include "datasets/units.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace tunnelrig {

/// From the lowest to the highest of some values.
struct Extent {
  double lowest = std::numeric_limits<double>::infinity();
  double highest = -std::numeric_limits<double>::infinity();

  double width() const { return highest - lowest; }
  void include(double value) { include(Extent{value, value}); }
  void include(const Extent& other) {
    lowest = std::min(lowest, other.lowest);
    highest = std::max(highest, other.highest);
  }
};

/// A cell's number as it is written, and the part of its sheet (a session, a block) that it is of.
struct PartValue {
  std::string part;
  std::size_t row = 0;
  double written = 0;
};

/// Parts that another unit brings into the range of all others.
struct AnotherUnit {
  std::vector<std::string> parts;
  std::size_t first_row = 0, last_row = 0;
  std::string_view unit;   // that they seem to be in
  Extent written, others;  // in the column's unit
  Extent converted;        // to it, were they in that other one
};

/// Least factor between two units of parts of one experiment, and of groups of which each may be another
/// rotor: these differ by small factors for good reasons.
inline constexpr double kLeastFactor = 3, kLeastFactorOfGroups = 30;

/// Nothing where all parts seem to be in `unit`. Otherwise the fewer, of at least twice as many others (and
/// two), which
/// - lie beyond a gap that is wider than the range of all others;
/// - converted from exactly one other unit of the same quantity lie in that range, widened by half of it on
///   either side and at least by 1 % (temperatures: 3 K);
/// - are changed by that unit by 6 times the range so widened (temperatures: twice), or converted begin and
///   end where the others do, as a repeated sweep does: a column that is set part by part fits some unit by
///   chance. So that settings are no mistake, a factor of 10 counts of sweeps only, and one below
///   `least_factor` never.
/// Temperatures are compared by differences, all others by ratios, without what is 0: it is so in any unit.
std::optional<AnotherUnit> another_unit(const std::vector<PartValue>& values, const Unit& unit,
                                        double least_factor = kLeastFactor);

}  // namespace tunnelrig
