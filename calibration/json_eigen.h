// Eigen and std::optional in JSON. Private to calibration/.
#pragma once

#include "datasets/error.h"

#include <optional>
#include <utility>

#include <Eigen/Core>
#include <nlohmann/json.hpp>

namespace nlohmann {

template <typename T>
struct adl_serializer<std::optional<T>> {
  static void to_json(json& out, const std::optional<T>& value) {
    out = value ? json(*value) : json(nullptr);
  }
  static void from_json(const json& in, std::optional<T>& value) {
    value = in.is_null() ? std::optional<T>() : std::optional<T>(in.get<T>());
  }
};

/// A vector is an array, a matrix an array of rows.
template <int Rows, int Columns>
struct adl_serializer<Eigen::Matrix<double, Rows, Columns>> {
  using Matrix = Eigen::Matrix<double, Rows, Columns>;

  static void to_json(json& out, const Matrix& matrix) {
    out = json::array();
    for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
      if constexpr (Columns == 1) {
        out.push_back(matrix[i]);
      } else {
        json row = json::array();
        for (Eigen::Index j = 0; j < matrix.cols(); ++j) row.push_back(matrix(i, j));
        out.push_back(std::move(row));
      }
    }
  }

  static void from_json(const json& in, Matrix& matrix) {
    const auto rows = static_cast<Eigen::Index>(in.size());
    const Eigen::Index columns = Columns == 1 ? 1
                                 : rows == 0  ? 0
                                              : static_cast<Eigen::Index>(in.at(0).size());
    if ((Rows >= 0 && rows != Rows) || (Columns >= 0 && columns != Columns)) {
      throw tunnelrig::InputError(
          fmt::format("a {} × {} matrix stands where one of another size belongs", rows, columns));
    }
    matrix.resize(rows, columns);
    for (Eigen::Index i = 0; i < rows; ++i) {
      const json& row = in.at(static_cast<std::size_t>(i));
      for (Eigen::Index j = 0; j < columns; ++j) {
        (Columns == 1 ? row : row.at(static_cast<std::size_t>(j))).get_to(matrix(i, j));
      }
    }
  }
};

}  // namespace nlohmann
