// Maps measured on the published field: the 42 locations of the thesis with errors of known covariance.
#pragma once

#include "analysis/maps/map_input.h"
#include "analysis/maps/tunnel_maps.h"

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace tunnelrig::test {

inline constexpr std::array kMethods = {MapMethod::kGaussianProcess, MapMethod::kThinPlateSpline};

struct MeasurementErrors {
  double independent_percent = 0.1;  // of C_T, and percentage points of U
  double shared_gain_percent = 0;    // of every C_T alike
  double shared_u_percent = 0;       // percentage points of every U alike
};

/// The published field, measured with normal errors, whose covariance is declared.
MapInput published_input(std::uint64_t seed, const MeasurementErrors& errors = {});

/// The same without errors, declared as if it had them.
MapInput exact_input(const MeasurementErrors& errors = {});

/// The published field in per cent.
double true_delta_ct_percent(const TunnelPoint& point);
double true_uneven_thrust_percent(const TunnelPoint& point);

/// Only the locations with these labels, or without them.
MapInput only(const MapInput& input, const std::vector<std::string>& labels);

/// What the call throws, or "no InputError".
std::string message_of(const std::function<void()>& call);

}  // namespace tunnelrig::test
