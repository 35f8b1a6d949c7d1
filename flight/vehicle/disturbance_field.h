// The map as flight feels it: a smooth field over normalised coordinates.
#pragma once

#include "analysis/maps/disturbance_map.h"
#include "flight/vehicle/random.h"

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace tunnelrig {

/// What the walls do to the rotors at one place, at constant speed.
struct Disturbance {
  double thrust_change = 0;  // ΔC_T as a fraction
  double uneven = 0;         // U (5.1) as a fraction; negative rolls to the right

  /// Thrust of a right and a left rotor over that at OT.
  double right_factor() const { return (1 + thrust_change) * (1 + uneven); }
  double left_factor() const { return (1 + thrust_change) * (1 - uneven); }
};

/// By how many of its standard uncertainties a layer of a map is wrong, place by place: one draw of a random
/// field of variance 1. It changes over the section, as a fit's errors do. One that had the same sign
/// everywhere would be a constant force, which an integral takes out as if it were not there.
class MapError {
 public:
  MapError() = default;  // none
  MapError(double size, Random& random);

  double at(double y_norm, double z_norm) const;

 private:
  struct Wave {
    double y, z, phase_rad;
  };

  std::array<Wave, 32> waves_{};
  double amplitude_ = 0;
};

/// Bicubic spline through the map's nodes (de Boor 1962), twice continuously differentiable. It is built from
/// the right half and mirrored, so that ΔC_T is even and U odd in ȳ to the last bit. Outside [−1, 1]² the
/// value at the nearest point of the border.
class DisturbanceField {
 public:
  /// No disturbance anywhere.
  DisturbanceField() = default;

  /// `scale` multiplies both layers. There are no errors where the uncertainty is not known.
  explicit DisturbanceField(const DisturbanceMap& map, double scale = 1, const MapError& thrust_error = {},
                            const MapError& uneven_error = {});

  Disturbance at(double y_norm, double z_norm) const;

  /// Whether a place is outside the map.
  static bool outside(double y_norm, double z_norm) {
    return !(y_norm >= -1 && y_norm <= 1 && z_norm >= -1 && z_norm <= 1);
  }

 private:
  struct alignas(64) Node {
    double f[2]{}, f_y[2]{}, f_z[2]{}, f_yz[2]{};  // ΔC_T and U, fractions
  };

  struct Cell {
    double low, high, width, per_width;
    std::size_t first_node;  // the number of nodes before it
  };

  /// The cells between an axis's nodes, and where to begin the search for one.
  struct Axis {
    std::vector<Cell> cells;
    std::vector<std::uint32_t> buckets;  // for equal parts of [low, 1], the cell of its lower end

    Axis() = default;
    /// Neighbours on the axis, which goes from `low` to 1, are `stride` nodes apart.
    Axis(const std::vector<double>& nodes, double low, std::size_t stride);

    /// `bucket` is where `value`, which is on the axis, lies among the buckets.
    const Cell& cell_of(double value, double bucket) const;
  };

  Axis y_, z_;  // y_ from 0 to 1
  std::size_t columns_ = 0;
  std::vector<Node> nodes_;  // row by row, rows follow z
};

/// The field that datasets/published_field.h invents within the thesis's claims, for the rig's geometry, on
/// 41 × 41 nodes, with no uncertainty: what flies where no measured map is given.
DisturbanceMap published_disturbance_map();

}  // namespace tunnelrig
