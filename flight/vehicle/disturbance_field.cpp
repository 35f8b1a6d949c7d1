#include "flight/vehicle/disturbance_field.h"

#include "datasets/published_field.h"
#include "datasets/thesis.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace tunnelrig {
namespace {

constexpr std::size_t kBuckets = 64;

/// Slopes of the natural cubic spline through (x, f): its tridiagonal system in the first derivatives.
std::vector<double> spline_slopes(const std::vector<double>& x, const std::vector<double>& f) {
  const std::size_t n = x.size();
  std::vector<double> diagonal(n), above(n), right(n);
  for (std::size_t i = 0; i < n; ++i) {
    const double before = i > 0 ? 1 / (x[i] - x[i - 1]) : 0, after = i + 1 < n ? 1 / (x[i + 1] - x[i]) : 0;
    diagonal[i] = 2 * (before + after);
    above[i] = after;
    right[i] = 3 * ((i > 0 ? (f[i] - f[i - 1]) * before * before : 0) +
                    (i + 1 < n ? (f[i + 1] - f[i]) * after * after : 0));
  }
  for (std::size_t i = 1; i < n; ++i) {
    const double factor = above[i - 1] / diagonal[i - 1];
    diagonal[i] -= factor * above[i - 1];
    right[i] -= factor * right[i - 1];
  }
  std::vector<double> slope(n);
  for (std::size_t i = n; i-- > 0;) {
    slope[i] = (right[i] - (i + 1 < n ? above[i] * slope[i + 1] : 0)) / diagonal[i];
  }
  return slope;
}

/// A table over the mirrored columns and the rows; derivatives along either axis keep its shape.
struct Layer {
  std::vector<double> y, z, value;

  std::vector<double> along_y(const std::vector<double>& f) const {
    std::vector<double> result(f.size()), line(y.size());
    for (std::size_t row = 0; row < z.size(); ++row) {
      std::copy_n(f.begin() + static_cast<std::ptrdiff_t>(row * y.size()), y.size(), line.begin());
      const auto slope = spline_slopes(y, line);
      std::copy(slope.begin(), slope.end(), result.begin() + static_cast<std::ptrdiff_t>(row * y.size()));
    }
    return result;
  }

  std::vector<double> along_z(const std::vector<double>& f) const {
    std::vector<double> result(f.size()), line(z.size());
    for (std::size_t column = 0; column < y.size(); ++column) {
      for (std::size_t row = 0; row < z.size(); ++row) line[row] = f[row * y.size() + column];
      const auto slope = spline_slopes(z, line);
      for (std::size_t row = 0; row < z.size(); ++row) result[row * y.size() + column] = slope[row];
    }
    return result;
  }
};

/// The map's right half with its mirror image; `sign` is −1 for an odd layer.
Layer mirrored(const MapGrid& grid, const std::vector<double>& right_value, double sign) {
  Layer layer{{}, grid.z_norm, {}};
  std::vector<std::size_t> columns;
  for (std::size_t c = 0; c < grid.y_norm.size(); ++c) {
    if (grid.y_norm[c] >= 0) columns.push_back(c);
  }
  for (std::size_t i = columns.size(); i-- > 1;) layer.y.push_back(-grid.y_norm[columns[i]]);
  for (const std::size_t c : columns) layer.y.push_back(grid.y_norm[c]);
  for (std::size_t row = 0; row < grid.z_norm.size(); ++row) {
    const auto value = [&](std::size_t i) { return right_value[grid.index(row, columns[i])]; };
    for (std::size_t i = columns.size(); i-- > 1;) layer.value.push_back(sign * value(i));
    layer.value.push_back(sign < 0 ? 0 : value(0));
    for (std::size_t i = 1; i < columns.size(); ++i) layer.value.push_back(value(i));
  }
  return layer;
}

/// Hermite's cubic basis on a cell along y and along z, side by side: weights of value and slope at its lower
/// and upper end.
struct Basis {
  double low[2], low_slope[2], high[2], high_slope[2];

  Basis(const double (&t)[2], const double (&width)[2]) {
    for (std::size_t i = 0; i < 2; ++i) {
      const double t2 = t[i] * t[i], back = t[i] - 1, back_width = back * width[i];
      high[i] = t2 * (3 - 2 * t[i]);
      low[i] = 1 - high[i];
      low_slope[i] = t[i] * back * back_width;
      high_slope[i] = t2 * back_width;
    }
  }
};

}  // namespace

DisturbanceField::Axis::Axis(const std::vector<double>& nodes, double low, std::size_t stride) {
  for (std::size_t i = 0; i + 1 < nodes.size(); ++i) {
    const double width = nodes[i + 1] - nodes[i];
    cells.push_back({nodes[i], nodes[i + 1], width, 1 / width, i * stride});
  }
  cells.back().high = std::numeric_limits<double>::infinity();  // ends every search
  for (std::size_t b = 0; b <= kBuckets; ++b) {
    const double end = low + (1 - low) * static_cast<double>(b) / kBuckets;
    buckets.push_back(b > 0 ? buckets.back() : 0);
    while (cells[buckets.back()].high <= end) ++buckets.back();
  }
}

inline const DisturbanceField::Cell& DisturbanceField::Axis::cell_of(double value, double bucket) const {
  const Cell* cell = &cells[buckets[static_cast<std::uint32_t>(bucket)]];
  while (cell->high <= value) ++cell;
  return *cell;
}

// A sum of waves of random direction, length and phase, which is nearly normal at every place and has the
// covariance exp(−d²/2ℓ²) (Rahimi and Recht 2007).
MapError::MapError(double size, Random& random)
    : amplitude_(size * std::sqrt(2.0 / static_cast<double>(waves_.size()))) {
  // Normalised; shorter than the field's own 0.8, as a fit's errors change from one measured place to the
  // next. Assumed.
  constexpr double kLength = 0.5;
  for (Wave& wave : waves_) {
    wave.y = random.normal() / kLength;
    wave.z = random.normal() / kLength;
    wave.phase_rad = 2 * std::numbers::pi * random.uniform();
  }
}

double MapError::at(double y_norm, double z_norm) const {
  if (amplitude_ == 0) return 0;
  double sum = 0;
  for (const Wave& wave : waves_) sum += std::cos(wave.y * y_norm + wave.z * z_norm + wave.phase_rad);
  return amplitude_ * sum;
}

DisturbanceField::DisturbanceField(const DisturbanceMap& map, double scale, const MapError& thrust_error,
                                   const MapError& uneven_error) {
  const double coverage = map.coverage_factor > 0 ? map.coverage_factor : 2;
  const auto fractions = [&](const MapLayer& layer, const MapError& error) {
    std::vector<double> f(layer.value_percent.size());
    for (std::size_t row = 0; row < map.grid.z_norm.size(); ++row) {
      for (std::size_t column = 0; column < map.grid.y_norm.size(); ++column) {
        const std::size_t i = map.grid.index(row, column);
        const double u95 = layer.u95_percent[i];  // which may be NaN
        const double wrong = u95 > 0 ? error.at(map.grid.y_norm[column], map.grid.z_norm[row]) : 0;
        f[i] = 0.01 * (scale * layer.value_percent[i] + (wrong != 0 ? wrong * u95 / coverage : 0));
      }
    }
    return f;
  };
  const std::array<Layer, 2> layers = {mirrored(map.grid, fractions(map.delta_ct, thrust_error), 1),
                                       mirrored(map.grid, fractions(map.uneven_thrust, uneven_error), -1)};
  const std::size_t columns = layers[0].y.size(), first = columns / 2;
  const std::vector<double> right(layers[0].y.begin() + static_cast<std::ptrdiff_t>(first),
                                  layers[0].y.end());
  const std::vector<double>& z = layers[0].z;
  y_ = Axis(right, 0, 1);
  z_ = Axis(z, -1, right.size());
  columns_ = right.size();
  nodes_.resize(right.size() * z.size());
  for (std::size_t k = 0; k < layers.size(); ++k) {
    const auto f_y = layers[k].along_y(layers[k].value), f_z = layers[k].along_z(layers[k].value);
    const auto f_yz = layers[k].along_z(f_y);
    for (std::size_t row = 0; row < z.size(); ++row) {
      for (std::size_t c = 0; c < right.size(); ++c) {
        Node& node = nodes_[row * right.size() + c];
        const std::size_t i = row * columns + first + c;
        node.f[k] = layers[k].value[i];
        node.f_y[k] = f_y[i];
        node.f_z[k] = f_z[i];
        node.f_yz[k] = f_yz[i];
      }
    }
  }
}

Disturbance DisturbanceField::at(double y_norm, double z_norm) const {
  if (nodes_.empty()) return {};
  // In this order NaN becomes a number, so that it never is an index.
  const double y = std::min(1.0, std::abs(y_norm)), z = std::max(-1.0, std::min(1.0, z_norm));
  const Cell& cell_y = y_.cell_of(y, kBuckets * y);
  const Cell& cell_z = z_.cell_of(z, 0.5 * kBuckets * (z + 1));
  const Basis b({(y - cell_y.low) * cell_y.per_width, (z - cell_z.low) * cell_z.per_width},
                {cell_y.width, cell_z.width});
  const Node* low = &nodes_[cell_z.first_node + cell_y.first_node];
  const Node* high = low + columns_;
  double value[2];
  for (std::size_t k = 0; k < 2; ++k) {
    // Sums in pairs: they wait for each other no longer than they must.
    const auto across = [&](const Node* row) {
      return (b.low[0] * row[0].f[k] + b.low_slope[0] * row[0].f_y[k]) +
             (b.high[0] * row[1].f[k] + b.high_slope[0] * row[1].f_y[k]);
    };
    const auto across_slope = [&](const Node* row) {
      return (b.low[0] * row[0].f_z[k] + b.low_slope[0] * row[0].f_yz[k]) +
             (b.high[0] * row[1].f_z[k] + b.high_slope[0] * row[1].f_yz[k]);
    };
    value[k] = (b.low[1] * across(low) + b.low_slope[1] * across_slope(low)) +
               (b.high[1] * across(high) + b.high_slope[1] * across_slope(high));
  }
  return {value[0], y_norm < 0 ? -value[1] : value[1]};
}

DisturbanceMap published_disturbance_map() {
  DisturbanceMap map;
  map.geometry = {0.7434, 0.3, 1.5, 1.5, 0.1524};
  for (int i = -20; i <= 20; ++i) {
    map.grid.y_norm.push_back(i / 20.0);
    map.grid.z_norm.push_back(i / 20.0);
  }
  for (const double z : map.grid.z_norm) {
    for (const double y : map.grid.y_norm) {
      map.delta_ct.value_percent.push_back(100 * published_thrust_change(y, z));
      map.uneven_thrust.value_percent.push_back(100 * published_uneven_thrust(y, z));
    }
  }
  map.delta_ct.u95_percent.assign(map.grid.nodes(), 0);
  map.uneven_thrust.u95_percent.assign(map.grid.nodes(), 0);
  map.method = "published";
  map.coverage_factor = 2;
  map.c_t_origin = thesis::kCtTunnelOrigin;
  map.c_t_open_space = thesis::kCtOpenSpace;
  return map;
}

}  // namespace tunnelrig
