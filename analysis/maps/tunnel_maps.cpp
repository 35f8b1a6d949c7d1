#include "analysis/maps/tunnel_maps.h"

#include "datasets/error.h"

#include <cmath>

namespace tunnelrig {
namespace {

FittedField fit(const FieldData& data, const MapSettings& settings) {
  if (settings.method == MapMethod::kThinPlateSpline) return ThinPlateSpline(data);
  return GaussianProcess(data, fit_hyperparameters(data, settings.priors));
}

/// To 10⁻⁶, far below what is known; a −0 becomes 0.
double rounded(double percent) { return std::round(percent * 1e6) / 1e6 + 0.0; }

FitSummary summary_of(const FittedField& field) {
  FitSummary summary{.leave_one_out = summarize(leave_one_out(field))};
  if (const auto* process = std::get_if<GaussianProcess>(&field)) {
    const Hyperparameters& h = process->hyperparameters();
    summary.hyperparameters = {{"amplitude_percent", h.amplitude_percent},
                               {"length_y", h.length_y},
                               {"length_z", h.length_z},
                               {"excess_percent", h.excess_percent}};
  }
  if (const auto offset = offset_of(field)) {
    summary.offset = RigOffset{rounded(offset->value), rounded(offset->u95())};
  }
  return summary;
}

constexpr double kNormalCoverage = 1.96;  // flight draws normal errors: u95 over this, whatever the dof

}  // namespace

std::string name_of(MapMethod method) {
  return method == MapMethod::kGaussianProcess ? "gaussian-process" : "thin-plate-spline";
}

MapMethod map_method(const std::string& name) {
  for (const MapMethod method : {MapMethod::kGaussianProcess, MapMethod::kThinPlateSpline}) {
    if (name == name_of(method)) return method;
  }
  throw InputError(fmt::format("'{}' is no map method; there are {} and {}", name,
                               name_of(MapMethod::kGaussianProcess), name_of(MapMethod::kThinPlateSpline)));
}

TunnelMaps fit_maps(const MapInput& input, const MapSettings& settings) {
  MapInput merged = merge_locations(input);
  FittedField delta_ct = fit(thrust_change_data(merged), settings);
  FittedField uneven_thrust = fit(uneven_thrust_data(merged), settings);
  return {std::move(merged), settings, std::move(delta_ct), std::move(uneven_thrust)};
}

FieldEstimate estimate_at(const FittedField& field, const TunnelPoint& point) {
  return std::visit([&](const auto& fitted) { return fitted.at(point); }, field);
}

std::optional<FieldEstimate> offset_of(const FittedField& field) {
  return std::visit([](const auto& fitted) { return fitted.offset(); }, field);
}

std::vector<MeasuredField> measured_field(const FittedField& field) {
  return std::visit([](const auto& fitted) { return fitted.measured(); }, field);
}

std::vector<LeftOut> leave_one_out(const FittedField& field) {
  return std::visit([](const auto& fitted) { return fitted.leave_one_out(); }, field);
}

MapGrid regular_grid(int nodes) {
  if (!is_grid_size(nodes)) {
    throw InputError(
        fmt::format("a grid of {} nodes a side: the number must be odd, from 3 to {}", nodes, kMostNodes));
  }
  std::vector<double> axis(static_cast<std::size_t>(nodes));
  for (int i = 0; i < nodes; ++i) axis[static_cast<std::size_t>(i)] = (2.0 * i - (nodes - 1)) / (nodes - 1);
  return {axis, axis};
}

MapLayer sample(const FittedField& field, const MapGrid& grid, const std::function<void()>& after_row) {
  MapLayer layer;
  for (const double z_norm : grid.z_norm) {
    for (const double y_norm : grid.y_norm) {
      const FieldEstimate estimate = estimate_at(field, {y_norm, z_norm});
      layer.value_percent.push_back(rounded(estimate.value));
      layer.u95_percent.push_back(rounded(estimate.u95()));
    }
    if (after_row) after_row();
  }
  return layer;
}

DisturbanceMap disturbance_map(const TunnelMaps& maps, int nodes, const std::string& provenance,
                               const MapProgress& progress) {
  const MapGrid grid = regular_grid(nodes);
  int rows = 0;
  const auto after_row = [&] {
    if (progress) progress(++rows, 2 * nodes);
  };
  return {.geometry = maps.input.geometry,
          .grid = grid,
          .delta_ct = sample(maps.delta_ct, grid, after_row),
          .uneven_thrust = sample(maps.uneven_thrust, grid, after_row),
          .locations = measured_locations(maps.input),
          .method = name_of(maps.settings.method),
          .coverage_factor = kNormalCoverage,
          .c_t_origin = thrust_coefficient_at_origin(maps.input),
          .c_t_open_space = maps.input.c_t_open_space,
          .delta_ct_fit = summary_of(maps.delta_ct),
          .uneven_thrust_fit = summary_of(maps.uneven_thrust),
          .provenance = provenance};
}

}  // namespace tunnelrig
