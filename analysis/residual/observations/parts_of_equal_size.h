#pragma once

#include <algorithm>
#include <map>
#include <numeric>
#include <vector>

namespace tunnelrig {

/// The part, from 0, in order of value, that each value is in: at most `count` parts of about as many values.
/// Equal values are in one part, and so there may be fewer; no more values than parts have one each.
inline std::vector<int> parts_of_equal_size(const std::vector<double>& values, int count) {
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), 0U);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return values[a] < values[b]; });
  std::size_t different = 0;
  for (std::size_t k = 0; k < order.size(); ++k)
    if (k == 0 || values[order[k]] != values[order[k - 1]]) ++different;
  const bool each = different <= static_cast<std::size_t>(count);
  std::vector<int> part(values.size());
  std::map<std::size_t, int> filled;
  std::size_t nominal = 0;
  for (std::size_t k = 0; k < order.size(); ++k) {
    if (k == 0 || values[order[k]] != values[order[k - 1]])
      nominal = each ? k : k * static_cast<std::size_t>(count) / order.size();
    part[order[k]] = filled.emplace(nominal, static_cast<int>(filled.size())).first->second;
  }
  return part;
}

}  // namespace tunnelrig
