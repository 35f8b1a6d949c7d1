// The campaign file: one SQLite file that holds a campaign (schema.sql, docs/campaign-file.md).
#pragma once

#include "datasets/campaign.h"
#include "datasets/csv.h"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tunnelrig {

class Database;

/// What a derived document was made by and from.
struct Provenance {
  std::string program_version;
  std::string arguments;  // the command line
  std::string inputs;     // JSON object: ids and hashes of what the document depends on
};

/// A derived result (a calibration certificate, a reduction, a map, a model) as it is stored.
struct Document {
  std::int64_t id = 0;
  std::string kind;
  std::string created_utc;
  Provenance provenance;
  std::string json;
};

/// Whether this user may write to the file and, for the journal beside it, in its folder.
bool can_be_changed(const std::filesystem::path& path);

/// One connection to a campaign file. Methods throw StorageError where the file cannot be read or written and
/// InputError where its contents break a rule of the campaign format. Not for use by two threads at once.
class CampaignFile {
 public:
  enum class Access {
    kRead,    // the file must exist; nothing is written
    kWrite,   // the file must exist; short transactions beside a recorder are fine
    kRecord,  // created where missing; a second recorder of the same file is refused with InputError
  };

  CampaignFile(const std::filesystem::path& path, Access access);
  ~CampaignFile();
  CampaignFile(CampaignFile&&) noexcept;
  CampaignFile& operator=(CampaignFile&&) = delete;

  const std::filesystem::path& path() const { return path_; }

  /// True where this connection made the file, and not merely opened it.
  bool made() const { return made_; }

  /// True where neither a campaign nor a table has been put in.
  bool empty() const;

  /// Runs `work` in one transaction: all that it writes is stored, or nothing where it throws.
  void atomically(const std::function<void()>& work);

  /// As `atomically`; false at once, and nothing done, where another connection is writing to the file.
  bool atomically_if_free(const std::function<void()>& work);

  // --- what arrived as files

  std::optional<std::string> text(std::string_view name) const;  // "campaign.toml", "table.toml"
  void set_text(std::string_view name, std::string_view text);

  std::optional<Sheet> sheet(
      std::string_view name) const;  // "runs", "calibration", "propellers", "observations"
  void set_sheet(std::string_view name, const Sheet& sheet);

  /// Appends a row, filling columns by name; columns that the sheet lacks are added to it.
  void append_row(std::string_view name, const std::vector<std::pair<std::string, std::string>>& cells);

  /// One cell of the row whose `key` column reads `value`; empty where the sheet lacks `column`. Throws
  /// InputError where there is no such row.
  std::string cell(std::string_view name, std::string_view key, std::string_view value,
                   std::string_view column) const;

  /// Sets that cell; a column that the sheet lacks is added.
  void set_cell(std::string_view name, std::string_view key, std::string_view value, std::string_view column,
                std::string_view text);

  /// Changes whenever another connection has written to the file.
  std::int64_t data_version() const;

  CampaignInfo info() const;  // throws InputError where the file holds no campaign
  std::vector<Run> runs() const;
  std::vector<CalibrationPoint> calibration_points() const;
  std::vector<PropellerTest> propeller_tests() const;

  // --- what was derived

  std::int64_t add_document(std::string_view kind, const Provenance& provenance, std::string_view json);
  std::optional<Document> newest_document(std::string_view kind) const;
  std::vector<Document> documents(std::string_view kind) const;

  /// Problems that SQLite itself finds; empty where all is well.
  std::string integrity_problems() const;

  Database& database() const { return *database_; }

 private:
  friend class StagedCampaign;
  struct Unsafe {};
  CampaignFile(const std::filesystem::path& path, Unsafe);  // no journal: for a file nobody else sees yet
  void open(Access access);

  std::filesystem::path path_;
  std::shared_ptr<void> lock_;  // held by a recorder
  bool made_ = false;
  std::unique_ptr<Database> database_;
};

/// The campaign file at a path, and what SQLite keeps beside it: journals, shared memory.
std::vector<std::filesystem::path> files_of_campaign(const std::filesystem::path& path);

/// Builds a campaign file under a temporary name beside `target` and puts it in place whole, or not at all.
class StagedCampaign {
 public:
  /// Throws InputError where `target` holds a campaign and `replace` is false, or is being recorded to.
  StagedCampaign(const std::filesystem::path& target, bool replace);
  ~StagedCampaign();
  StagedCampaign(const StagedCampaign&) = delete;
  StagedCampaign& operator=(const StagedCampaign&) = delete;

  CampaignFile& file() { return *file_; }

  /// Throws StorageError, and leaves the target as it was, where the new file may not be on the disk;
  /// InputError likewise, where another program's reading keeps the target from being whole until the last
  /// moment.
  void publish();

 private:
  std::filesystem::path target_, staged_;
  std::shared_ptr<void> lock_;
  std::unique_ptr<CampaignFile> file_;
};

/// Applies the parts of a schema (cut at "-- @version N") that are above the file's PRAGMA user_version.
void migrate(Database& database, std::string_view schema);

}  // namespace tunnelrig
