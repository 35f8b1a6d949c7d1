// From measured locations to the two fitted fields, and from those to the grid that is written.
#pragma once

#include "analysis/maps/disturbance_map.h"
#include "analysis/maps/gaussian_process.h"
#include "analysis/maps/hyperparameters.h"
#include "analysis/maps/map_input.h"
#include "analysis/maps/thin_plate_spline.h"

#include <functional>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace tunnelrig {

enum class MapMethod { kGaussianProcess, kThinPlateSpline };

/// "gaussian-process", "thin-plate-spline".
std::string name_of(MapMethod method);

/// The method of that name; throws InputError naming the two that there are.
MapMethod map_method(const std::string& name);

struct MapSettings {
  MapMethod method = MapMethod::kGaussianProcess;
  HyperparameterPriors priors;  // of the Gaussian process
};

using FittedField = std::variant<GaussianProcess, ThinPlateSpline>;

struct TunnelMaps {
  MapInput input;  // checked and merged
  MapSettings settings;
  FittedField delta_ct;
  FittedField uneven_thrust;
};

/// Throws InputError as merge_locations does. 42 locations take some 0.02 s.
TunnelMaps fit_maps(const MapInput& input, const MapSettings& settings = {});

/// The field at a point, per cent. Throws InputError outside [−1, 1]².
FieldEstimate estimate_at(const FittedField& field, const TunnelPoint& point);

/// The constant that the rig adds to what it measures of a field (rig_offset.h), per cent; nothing where no
/// location shows it, and none of ΔC_T.
std::optional<FieldEstimate> offset_of(const FittedField& field);

/// Every measured value off the middle plane, on ȳ > 0, less that offset: the field as its location alone has
/// it.
std::vector<MeasuredField> measured_field(const FittedField& field);

/// How well each location is predicted by the others.
std::vector<LeftOut> leave_one_out(const FittedField& field);

/// Along each side of a grid, 0.004 apart: time and memory go with the square.
constexpr int kMostNodes = 501;

/// An odd number from 3 to kMostNodes: one node is at (0, 0).
constexpr bool is_grid_size(int nodes) { return nodes >= 3 && nodes <= kMostNodes && nodes % 2 == 1; }

/// A regular grid over [−1, 1]²; `nodes` along each side. Throws InputError where that is no grid size.
MapGrid regular_grid(int nodes);

/// The field on a grid, rounded to 10⁻⁶ percentage points; never −0.
MapLayer sample(const FittedField& field, const MapGrid& grid, const std::function<void()>& after_row = {});

/// Of a grid's rows; 501 nodes a side take some 20 s.
using MapProgress = std::function<void(int done, int total)>;

/// What disturbance_map.json holds. `provenance` is the text of a JSON object.
DisturbanceMap disturbance_map(const TunnelMaps& maps, int nodes, const std::string& provenance,
                               const MapProgress& progress = {});

}  // namespace tunnelrig
