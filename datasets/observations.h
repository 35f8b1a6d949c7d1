// Tables of observations from other rigs: any CSV, with a schema (docs/tables.md) that says what its columns
// are.
#pragma once

#include "datasets/campaign_file.h"
#include "datasets/csv.h"
#include "datasets/units.h"

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tunnelrig {

/// A column and what it means.
struct TableColumn {
  std::string column;
  std::string unit;
  std::string meaning;  // a name the suite knows ("speed_rpm", "air_temperature_C", …); empty: a covariate
                        // like any other

  const std::string& name() const { return meaning.empty() ? column : meaning; }
  /// What values are in once converted: SI, but where the name says another unit (hours_in_session,
  /// tilt_deg).
  std::string_view kept_unit() const;
  double converted(double value) const;
};

inline constexpr std::string_view kTableFormat = "tunnelrig-table/1";

/// "bins(COLUMN, N)": N parts of equal size by the column's value.
struct Bins {
  std::string column;
  int count = 0;
};

/// table.toml.
struct TableSchema {
  std::string name;
  std::string scatter;              // of the response: "relative", "absolute", or empty: as its unit suggests
  TableColumn response;             // meaning: thrust_N, c_t, c_t_helicopter, c_t_propeller, or empty
  std::vector<std::string> groups;  // columns that together name a group, which has its own baseline
  std::string blocks = "rows";      // a column, "rows", or "bins(column, n)"
  std::string hold_out;             // expression over columns; empty: none
  std::vector<TableColumn> covariates;
  std::optional<std::string> speed_column;
  double speed_factor = 1;  // 2 / pole count where the column holds electrical revolutions
  std::optional<std::string> diameter_column;
  double diameter_unit_m = 1;
  std::optional<double> diameter_m;  // of all rows
  double air_temperature_C = 15;     // of all rows, where no column says
  double air_pressure_Pa = 101325;
  std::optional<Bins> bins;  // where the blocks are
  std::string toml, file;    // its text, and what messages call it
  int groups_line = 0, blocks_line = 0, hold_out_line = 0;
};

/// Throws InputError naming file, line and key.
TableSchema parse_table_schema(const std::string& text, const std::string& file);

/// One row, in SI (speeds in rev/min, temperatures in °C).
struct Observation {
  std::string place;  // file and line of the CSV, for messages
  std::string group;
  double response = 0;
  std::optional<double> speed_rpm;
  std::optional<double> diameter_m;
  double air_temperature_C = 15;  // NaN: left empty in a column that others have filled
  double air_pressure_Pa = 101325;
};

struct ObservationTable {
  TableSchema schema;
  Sheet sheet;
  std::vector<Observation> rows;
  std::size_t without_response = 0;  // rows of a log that are left out
};

/// Checks a sheet against its schema and converts it. Throws InputError naming file, line and column.
ObservationTable read_observations(const Sheet& sheet, const TableSchema& schema);

/// The table that a campaign file holds; throws InputError where it holds none.
ObservationTable observations_of(const CampaignFile& file);

/// `import --format table`: any CSV with a schema.
ObservationTable read_table(const std::filesystem::path& csv, const std::filesystem::path& schema);

/// Stores a table as a new campaign file.
void store_table(const ObservationTable& table, const std::filesystem::path& file, bool replace);

}  // namespace tunnelrig
