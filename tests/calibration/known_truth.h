// Calibrations of which the truth is known: loads of several axes, and a cell's cycles.
#pragma once

#include "calibration/crosstalk.h"
#include "calibration/points.h"

#include <random>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <fmt/format.h>

namespace tunnelrig::test {

/// A table whose readings follow a known matrix: blocks of one axis each, a zero row first.
struct SyntheticTable {
  Eigen::MatrixXd matrix, even;
  std::vector<std::vector<double>> loads;  // N, per axis
  double noise = 0;

  CrosstalkTable take(std::mt19937& engine) const {
    std::normal_distribution<double> normal(0, 1);
    const Eigen::Index n = matrix.rows();
    Eigen::Index rows = n;
    for (const auto& of_axis : loads) rows += static_cast<Eigen::Index>(of_axis.size());
    CrosstalkTable table{
        .file = "table.csv", .force_N = Eigen::MatrixXd::Zero(rows, n), .reading = Eigen::MatrixXd(rows, n)};
    Eigen::Index row = 0;
    for (Eigen::Index axis = 0; axis < n; ++axis) {
      table.axes.push_back(fmt::format("force_{}", axis));
      table.channels.push_back(fmt::format("reading_{}", axis));
      const Eigen::VectorXd zero = zero_of(axis);
      for (std::size_t load = 0; load <= loads[static_cast<std::size_t>(axis)].size(); ++load, ++row) {
        if (load > 0) table.force_N(row, axis) = loads[static_cast<std::size_t>(axis)][load - 1];
        const Eigen::VectorXd force = table.force_N.row(row).transpose();
        table.reading.row(row) = (zero + matrix * force + even * force.cwiseAbs()).transpose();
        for (Eigen::Index channel = 0; channel < n; ++channel)
          table.reading(row, channel) += noise * normal(engine);
        table.block.push_back(static_cast<int>(axis));
        table.line.push_back(static_cast<int>(row) + 2);
      }
    }
    return table;
  }

  Eigen::VectorXd zero_of(Eigen::Index block) const {
    return Eigen::VectorXd::LinSpaced(matrix.rows(), 1, 2) * static_cast<double>(block + 1);
  }
};

inline SyntheticTable three_axes() {
  Eigen::Matrix3d matrix;
  matrix << 2, 0.1, -0.05, 0.08, -3, 0.2, 0.02, 0.3, 2.5;
  return {matrix, Eigen::Matrix3d::Zero(), {{2, 5, 7, 9}, {2, 5, 7, 9}, {-2, -5, -7, -9}}};
}

inline SyntheticTable both_ways() {
  SyntheticTable table = three_axes();
  table.even << 0.04, 0, 0, 0.01, -0.02, 0, 0, 0.03, 0;  // axis 2 is loaded one way
  table.loads = {{2, 5, 9, -3, -9}, {2, 5, 9, -3, -9}, {2, 5, 9}};
  return table;
}

struct Reading {
  double force_N;
  const char* direction = "";
};

/// Points in sequence on 0.3 + 0.2 · force plus `extra`, with noise.
template <typename Extra>
std::vector<CalibrationPoint> take(const std::vector<Reading>& readings, double noise_V, unsigned seed,
                                   Extra extra) {
  std::mt19937 engine(seed);
  std::normal_distribution<double> normal(0, 1);
  std::vector<CalibrationPoint> points;
  for (const Reading& reading : readings) {
    const int index = static_cast<int>(points.size());
    points.push_back({.applied_force_N = reading.force_N,
                      .voltage_V = 0.3 + 0.2 * reading.force_N + extra(reading) + noise_V * normal(engine),
                      .sequence = index + 1,
                      .direction = reading.direction,
                      .line = index + 2});
  }
  return points;
}

inline std::vector<Reading> cycle() {
  std::vector<Reading> readings;
  for (int round = 0; round < 2; ++round) {
    for (const double force : {0.0, 2.0, 4.0, 6.0, 8.0, 10.0}) readings.push_back({force, "up"});
    for (const double force : {10.0, 8.0, 6.0, 4.0, 2.0, 0.0}) readings.push_back({force, "down"});
  }
  return readings;
}

inline double nothing(const Reading&) { return 0; }

}  // namespace tunnelrig::test
