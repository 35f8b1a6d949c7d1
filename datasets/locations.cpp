#include "datasets/locations.h"

#include "datasets/csv.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

namespace tunnelrig {
namespace {

// Table 4.1
constexpr std::array<double, 6> kColumns = {0, 0.2, 0.4, 0.6, 0.8, 0.99};
constexpr std::array<double, 7> kRows = {-0.95, -0.64, -0.32, 0, 0.32, 0.64, 0.95};
// Section 4.2.2
constexpr std::array<double, 10> kGround_R = {0.75, 1, 1.25, 1.5, 1.75, 2, 3, 4, 5, 6};
constexpr std::array<double, 9> kCeiling_R = {0.75, 1, 1.25, 1.5, 1.75, 2, 3, 4, 5};

std::optional<int> integer(std::string_view text, int lowest, int highest) {
  const auto value = parse_number(text);
  if (!value || *value < lowest || *value > highest || *value != std::floor(*value)) return {};
  return static_cast<int>(*value);
}

}  // namespace

std::optional<TunnelPoint> grid_point(std::string_view label) {
  if (label == "OT") return TunnelPoint{};
  const auto v = label.find('V');
  if (!label.starts_with('H') || v == std::string_view::npos) return {};
  const auto column = integer(label.substr(1, v - 1), 0, 5);
  const auto row = integer(label.substr(v + 1), -3, 3);
  if (!column || !row) return {};
  return TunnelPoint{kColumns[static_cast<std::size_t>(*column)], kRows[static_cast<unsigned>(*row + 3)]};
}

std::string canonical_location(std::string_view label) {
  return std::string(label == "H0V0" ? std::string_view("OT") : label);
}

std::optional<double> distance_of(std::string_view label, std::string_view prefix) {
  if (!label.starts_with(prefix)) return {};
  return parse_number(label.substr(prefix.size()));
}

std::vector<std::string> tunnel_grid() {
  std::vector<std::string> labels;
  for (std::size_t column = 0; column < kColumns.size(); ++column) {
    for (int row = 3; row >= -3; --row) {
      labels.push_back(canonical_location(fmt::format("H{}V{}", column, row)));
    }
  }
  return labels;
}

std::vector<std::string> open_space_grid() {
  std::vector<std::string> labels = {"OS"};
  for (const double distance : kGround_R) labels.push_back(fmt::format("GND{:g}", distance));
  for (const double distance : kCeiling_R) labels.push_back(fmt::format("CEIL{:g}", distance));
  return labels;
}

}  // namespace tunnelrig
