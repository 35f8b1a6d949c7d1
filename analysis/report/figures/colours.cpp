// What figures have in common: colours, points, data.
#include "analysis/maps/category_colours.h"
#include "analysis/report/figures/figures.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

namespace tunnelrig::report {

std::string category_colour(std::size_t i) { return kCategoryColours[i % kCategoryColours.size()]; }

std::string ordered_colour(std::size_t i, std::size_t n) {
  constexpr std::array kPlasma = {0x0d0887u, 0x41049du, 0x6a00a8u, 0x8f0da4u,
                                  0xb12a90u, 0xcc4778u, 0xe16462u, 0xf2844bu};
  const double at =
      n < 2 ? 0
            : static_cast<double>(kPlasma.size() - 1) * static_cast<double>(i) / static_cast<double>(n - 1);
  const std::size_t k = std::min(static_cast<std::size_t>(at), kPlasma.size() - 2);
  unsigned mixed = 0;
  for (const unsigned shift : {16u, 8u, 0u}) {
    const auto channel = [&](std::size_t j) { return static_cast<double>((kPlasma[j] >> shift) & 0xFFu); };
    const double value = channel(k) + (at - static_cast<double>(k)) * (channel(k + 1) - channel(k));
    mixed |= static_cast<unsigned>(std::lround(value)) << shift;
  }
  return fmt::format("#{:06x}", mixed);
}

std::string data_block(const std::string& name, const std::vector<std::vector<double>>& rows) {
  std::string text = fmt::format("${} << END\n", name);
  for (const auto& row : rows) {
    for (const double value : row) text += std::isfinite(value) ? fmt::format("{:.7g} ", value) : "NaN ";
    text += '\n';
  }
  return text + "END\n";
}

int point_type(std::size_t i) {
  constexpr std::array kTypes = {7, 5, 13, 9, 11, 15};
  return kTypes[i % kTypes.size()];
}

}  // namespace tunnelrig::report
