#include "published_input.h"

#include "datasets/error.h"
#include "datasets/locations.h"
#include "datasets/published_field.h"
#include "datasets/thesis.h"

#include <algorithm>
#include <cmath>
#include <random>

namespace tunnelrig::test {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

MapInput measured(const std::function<double()>& error, const MeasurementErrors& errors) {
  MapInput input{.geometry = {.vehicle_width_m = 0.7434,
                              .vehicle_height_m = 0.3,
                              .tunnel_width_m = 1.5,
                              .tunnel_height_m = 1.5,
                              .propeller_radius_m = 0.1524},
                 .c_t_open_space = thesis::kCtOpenSpace};
  const double gain = 1 + errors.shared_gain_percent / 100 * error();
  const double offset_percent = errors.shared_u_percent * error();
  const double independent_c_t = thesis::kCtTunnelOrigin * errors.independent_percent / 100;
  for (const std::string& label : tunnel_grid()) {
    const TunnelPoint point = *grid_point(label);
    const double c_t = thesis::kCtTunnelOrigin * (1 + true_delta_ct_percent(point) / 100);
    input.locations.push_back({.label = label,
                               .y_norm = point.y_norm,
                               .z_norm = point.z_norm,
                               .c_t = gain * (c_t + independent_c_t * error()),
                               .u_percent = true_uneven_thrust_percent(point) +
                                            errors.independent_percent * error() + offset_percent});
  }
  const auto n = static_cast<Index>(input.locations.size());
  VectorXd c_t(n);
  for (Index i = 0; i < n; ++i) c_t(i) = input.locations[static_cast<std::size_t>(i)].c_t;
  const double gain_variance = std::pow(errors.shared_gain_percent / 100, 2);
  input.c_t_covariance =
      std::pow(independent_c_t, 2) * MatrixXd::Identity(n, n) + gain_variance * c_t * c_t.transpose();
  input.u_covariance = std::pow(errors.independent_percent, 2) * MatrixXd::Identity(n, n) +
                       MatrixXd::Constant(n, n, std::pow(errors.shared_u_percent, 2));
  return input;
}

}  // namespace

MapInput published_input(std::uint64_t seed, const MeasurementErrors& errors) {
  std::mt19937_64 engine(seed);
  std::normal_distribution<double> normal;
  return measured([&] { return normal(engine); }, errors);
}

MapInput exact_input(const MeasurementErrors& errors) {
  return measured([] { return 0.0; }, errors);
}

double true_delta_ct_percent(const TunnelPoint& point) {
  return 100 * published_thrust_change(point.y_norm, point.z_norm);
}

double true_uneven_thrust_percent(const TunnelPoint& point) {
  return 100 * published_uneven_thrust(point.y_norm, point.z_norm);
}

MapInput only(const MapInput& input, const std::vector<std::string>& labels) {
  MapInput few = input;
  few.locations.clear();
  std::vector<Index> kept;
  for (std::size_t i = 0; i < input.locations.size(); ++i) {
    if (std::find(labels.begin(), labels.end(), input.locations[i].label) == labels.end()) continue;
    few.locations.push_back(input.locations[i]);
    kept.push_back(static_cast<Index>(i));
  }
  few.c_t_covariance = input.c_t_covariance(kept, kept);
  few.u_covariance = input.u_covariance(kept, kept);
  return few;
}

std::string message_of(const std::function<void()>& call) {
  try {
    call();
  } catch (const InputError& error) {
    return error.what();
  }
  return "no InputError";
}

}  // namespace tunnelrig::test
