// Tables from rows of anything: each column is a name, a unit, a meaning, and how to get it from a row.
#pragma once

#include "analysis/exports/contents.h"

#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace tunnelrig::exports {

/// `rows` must outlive the builder. What `get` returns of a row decides the type of a column: floating point
/// and optional become numbers (nothing: NaN), bool a flag, other integers integers, and the rest text.
template <typename Row>
class TableBuilder {
 public:
  TableBuilder(std::string name, std::string meaning, const std::vector<Row>& rows)
      : rows_(rows), table_{std::move(name), std::move(meaning), {}} {}

  template <typename Get>
  TableBuilder& column(std::string name, std::string unit, std::string meaning, Get get) {
    using Value = std::decay_t<std::invoke_result_t<Get, const Row&>>;
    table_.columns.push_back({std::move(name), std::move(unit), std::move(meaning), values<Value>(get)});
    return *this;
  }

  /// With the unit that the name carries.
  template <typename Get>
  TableBuilder& column(const std::string& name, std::string meaning, Get get) {
    return column(name, std::string(unit_in_name(name)), std::move(meaning), get);
  }

  Table take() { return std::move(table_); }

 private:
  template <typename Value, typename Get>
  Values values(Get get) const {
    if constexpr (std::is_same_v<Value, bool>)
      return each<Flags>(get, [](bool value) { return static_cast<std::uint8_t>(value ? 1 : 0); });
    else if constexpr (std::is_integral_v<Value>)
      return each<Integers>(get, [](Value value) { return static_cast<std::int64_t>(value); });
    else if constexpr (std::is_floating_point_v<Value>)
      return each<Numbers>(get, [](double value) { return value; });
    else if constexpr (std::is_same_v<Value, std::optional<double>>)
      return each<Numbers>(get, [](const std::optional<double>& value) {
        return value.value_or(std::numeric_limits<double>::quiet_NaN());
      });
    else
      return each<Texts>(get, [](const auto& value) { return std::string(value); });
  }

  template <typename Container, typename Get, typename Convert>
  Values each(Get get, Convert convert) const {
    Container container;
    container.reserve(rows_.size());
    for (const Row& row : rows_) container.push_back(convert(std::invoke(get, row)));
    return container;
  }

  const std::vector<Row>& rows_;
  Table table_;
};

}  // namespace tunnelrig::exports
