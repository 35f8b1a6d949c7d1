#include "datasets/another_unit.h"

#include "datasets/unit_list.h"

#include <cmath>
#include <map>
#include <set>

namespace tunnelrig {
namespace {

struct Part {
  std::string name;
  Extent extent;  // on the scale
};

/// A number in `other`, were it in `unit`.
double converted(double written, const Unit& other, const Unit& unit) {
  return (other.convert(written) - unit.offset) / unit.factor;
}

bool same_conversion(const Unit& a, const Unit& b) {
  constexpr double kAlike = 1e-3;  // mmHg and Torr
  return std::abs(a.factor / b.factor - 1) < kAlike && std::abs(a.offset - b.offset) < kAlike;
}

/// Where another unit is another factor, values are compared by logarithms; temperatures as they are.
class Scale {
 public:
  explicit Scale(const Unit& unit) : unit_(unit), ratios_(unit.quantity != "temperature") {}

  bool ratios() const { return ratios_; }
  bool holds(double written) const { return !ratios_ || written != 0; }
  double at(double written) const { return ratios_ ? std::log(std::abs(written)) : written; }
  double shift(const Unit& other) const { return std::log(other.factor / unit_.factor); }  // of ratios

  Extent from(const Unit& other, const Extent& extent) const {
    if (ratios_) return {extent.lowest + shift(other), extent.highest + shift(other)};
    return {converted(extent.lowest, other, unit_), converted(extent.highest, other, unit_)};
  }

  /// By how much the range of the others is widened.
  double slack(const Extent& others) const {
    const double least = ratios_ ? 0.01 : 3 / unit_.factor;
    return std::max(0.5 * others.width(), least);
  }

 private:
  const Unit& unit_;
  bool ratios_;
};

/// The parts on either side of the widest gap between them.
struct Split {
  std::set<std::string> doubted;
  Extent of_doubted, of_others;
  double gap = 0;
};

std::vector<Part> parts_of(const std::vector<PartValue>& values, const Scale& scale) {
  std::map<std::string, Extent> extents;
  for (const PartValue& value : values)
    if (scale.holds(value.written)) extents[value.part].include(scale.at(value.written));
  std::vector<Part> parts;
  parts.reserve(extents.size());
  for (const auto& [name, extent] : extents) parts.push_back({name, extent});
  std::sort(parts.begin(), parts.end(),
            [](const Part& a, const Part& b) { return a.extent.lowest < b.extent.lowest; });
  return parts;
}

/// Nothing where the fewer are not few.
std::optional<Split> split(const std::vector<Part>& parts) {
  std::size_t below = 0;
  Split split;
  Extent so_far;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const double gap = i == 0 ? 0 : parts[i].extent.lowest - so_far.highest;
    if (gap > split.gap) {
      split.gap = gap;
      below = i;
    }
    so_far.include(parts[i].extent);
  }
  const std::size_t few = std::min(below, parts.size() - below), many = parts.size() - few;
  if (few == 0 || many < 2 * few) return {};
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const bool doubted = (i < below) == (few == below);
    (doubted ? split.of_doubted : split.of_others).include(parts[i].extent);
    if (doubted) split.doubted.insert(parts[i].name);
  }
  return split;
}

bool fits(const Split& split, const Scale& scale, const Unit& other) {
  const double slack = scale.slack(split.of_others);
  const Extent extent = scale.from(other, split.of_doubted);
  return extent.lowest >= split.of_others.lowest - slack && extent.highest <= split.of_others.highest + slack;
}

/// Both begin and end alike: a sweep that was repeated.
bool same_sweep(const Extent& one, const Extent& other) {
  const double room = 0.25 * other.width();
  return std::abs(one.lowest - other.lowest) <= room && std::abs(one.highest - other.highest) <= room;
}

/// Whether it says anything that a unit fits: what is to be met is small against what the unit changes.
bool telling(const Split& split, const Scale& scale, const Unit& other, double least_factor) {
  const Extent converted = scale.from(other, split.of_doubted);
  const double change = std::abs(split.of_doubted.lowest - converted.lowest);
  const double window = split.of_others.width() + 2 * scale.slack(split.of_others);
  if (!scale.ratios()) return 2 * window <= change || same_sweep(converted, split.of_others);
  if (change < std::log(least_factor)) return false;
  // What is set is set at round numbers: 10 mm and 100 mm are no mistake, a sweep of ten times as many may
  // be.
  constexpr double kSweep = 0.1;
  const bool ten = std::abs(change - std::log(10)) < 1e-3;
  return (!ten && 6 * window <= change) ||
         (split.of_others.width() >= kSweep && same_sweep(converted, split.of_others));
}

/// The one that fits; nullptr where none or several do.
const Unit* fitting_unit(const Split& split, const Scale& scale, const Unit& unit) {
  const Unit* found = nullptr;
  for (const Unit& other : known_units()) {
    if (other.quantity != unit.quantity || same_conversion(other, unit) || !fits(split, scale, other))
      continue;
    if (found != nullptr && !same_conversion(other, *found)) return nullptr;
    if (found == nullptr) found = &other;
  }
  return found;
}

}  // namespace

std::optional<AnotherUnit> another_unit(const std::vector<PartValue>& values, const Unit& unit,
                                        double least_factor) {
  const Scale scale(unit);
  const auto sides = split(parts_of(values, scale));
  if (!sides || sides->gap <= sides->of_others.width()) return {};
  const Unit* other = fitting_unit(*sides, scale, unit);
  if (other == nullptr || !telling(*sides, scale, *other, least_factor)) return {};
  AnotherUnit found{.parts = {sides->doubted.begin(), sides->doubted.end()},
                    .first_row = std::numeric_limits<std::size_t>::max(),
                    .unit = other->name};
  for (const PartValue& value : values) {
    if (!scale.holds(value.written)) continue;
    if (!sides->doubted.contains(value.part)) {
      found.others.include(value.written);
      continue;
    }
    found.written.include(value.written);
    found.converted.include(converted(value.written, *other, unit));
    found.first_row = std::min(found.first_row, value.row);
    found.last_row = std::max(found.last_row, value.row);
  }
  return found;
}

}  // namespace tunnelrig
