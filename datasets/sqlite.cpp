#include "datasets/sqlite.h"

#include <algorithm>
#include <limits>
#include <utility>

#include <fmt/format.h>

namespace tunnelrig {
namespace {

constexpr int kPatience_ms = 5000;  // with other connections that write

[[noreturn]] void fail(sqlite3* handle, int code) {
  const int extended = handle != nullptr ? sqlite3_extended_errcode(handle) : code;
  const char* file = handle != nullptr ? sqlite3_db_filename(handle, "main") : nullptr;
  std::string reason = handle != nullptr ? sqlite3_errmsg(handle) : sqlite3_errstr(code);
  // Beside a full disk, a file at the limit of its size (ulimit -f), also that which connections share.
  const bool cannot_grow = extended == SQLITE_IOERR_WRITE || extended == SQLITE_IOERR_SHMSIZE;
  if (cannot_grow) reason += ": is the disk full, or a file at its limit?";
  const bool disk_full = (extended & 0xFF) == SQLITE_FULL || cannot_grow;
  throw StorageError(fmt::format("{}: {}", file != nullptr && *file != '\0' ? file : "data base", reason),
                     disk_full);
}

}  // namespace

Database::Database(const std::string& path, int flags) {
  const int code = sqlite3_open_v2(path.c_str(), &handle_, flags | SQLITE_OPEN_NOMUTEX, nullptr);
  if (code != SQLITE_OK) {
    const std::string reason = handle_ != nullptr ? sqlite3_errmsg(handle_) : sqlite3_errstr(code);
    sqlite3_close_v2(handle_);
    throw StorageError(fmt::format("{}: {}", path, reason), false);
  }
  sqlite3_extended_result_codes(handle_, 1);
  sqlite3_busy_timeout(handle_, kPatience_ms);
}

Database::~Database() {
  for (const auto& [sql, statement] : compiled_) sqlite3_finalize(statement);
  sqlite3_close_v2(handle_);
}

void Database::execute(const std::string& sql) const {
  if (sqlite3_exec(handle_, sql.c_str(), nullptr, nullptr, nullptr) != SQLITE_OK) fail(handle_, SQLITE_ERROR);
}

std::string Database::scalar(const std::string& sql) const {
  Statement statement(*this, sql);
  return statement.step() ? statement.text(0) : std::string();
}

std::int64_t Database::scalar_integer(const std::string& sql) const {
  Statement statement(*this, sql);
  return statement.step() ? statement.integer(0) : 0;
}

std::int64_t Database::last_id() const { return sqlite3_last_insert_rowid(handle_); }

sqlite3_stmt* Database::take(std::string_view sql) const {
  if (const auto known = compiled_.find(std::string(sql)); known != compiled_.end()) {
    sqlite3_stmt* statement = known->second;
    compiled_.erase(known);
    return statement;
  }
  sqlite3_stmt* statement = nullptr;
  const int code = sqlite3_prepare_v3(handle_, sql.data(), static_cast<int>(sql.size()),
                                      SQLITE_PREPARE_PERSISTENT, &statement, nullptr);
  if (code != SQLITE_OK) fail(handle_, code);
  return statement;
}

void Database::give_back(sqlite3_stmt* statement) const {
  constexpr std::size_t kMostKept = 64;
  sqlite3_reset(statement);
  sqlite3_clear_bindings(statement);
  if (compiled_.size() >= kMostKept || !compiled_.emplace(sqlite3_sql(statement), statement).second)
    sqlite3_finalize(statement);
}

Statement::Statement(const Database& database, std::string_view sql)
    : database_(&database), statement_(database.take(sql)) {}

Statement::~Statement() {
  if (statement_ != nullptr) database_->give_back(statement_);
}

Statement::Statement(Statement&& other) noexcept
    : database_(other.database_), statement_(std::exchange(other.statement_, nullptr)), next_(other.next_) {}

void Statement::check(int code) const {
  if (code != SQLITE_OK) fail(sqlite3_db_handle(statement_), code);
}

Statement& Statement::bind(std::int64_t value) {
  check(sqlite3_bind_int64(statement_, next_++, value));
  return *this;
}

Statement& Statement::bind(double value) {
  check(sqlite3_bind_double(statement_, next_++, value));
  return *this;
}

Statement& Statement::bind(std::optional<double> value) {
  if (value) return bind(*value);
  check(sqlite3_bind_null(statement_, next_++));
  return *this;
}

Statement& Statement::bind(std::string_view value) {
  // An empty view may have no address, and SQLite would read that as NULL.
  const char* data = value.data() != nullptr ? value.data() : "";
  check(sqlite3_bind_text64(statement_, next_++, data, value.size(), SQLITE_TRANSIENT, SQLITE_UTF8));
  return *this;
}

Statement& Statement::bind(std::span<const std::byte> value) {
  const void* data = !value.empty() ? static_cast<const void*>(value.data()) : "";  // as with text
  check(sqlite3_bind_blob64(statement_, next_++, data, value.size(), SQLITE_STATIC));
  return *this;
}

bool Statement::step() {
  const int code = sqlite3_step(statement_);
  if (code == SQLITE_ROW) return true;
  if (code == SQLITE_DONE) return false;
  fail(sqlite3_db_handle(statement_), code);
}

void Statement::run() {
  step();
  reset();
}

void Statement::reset() {
  sqlite3_reset(statement_);
  next_ = 1;
}

std::int64_t Statement::integer(int column) const { return sqlite3_column_int64(statement_, column); }
double Statement::real(int column) const { return sqlite3_column_double(statement_, column); }

std::optional<double> Statement::maybe_real(int column) const {
  if (sqlite3_column_type(statement_, column) == SQLITE_NULL) return {};
  return real(column);
}

std::string Statement::text(int column) const {
  const auto* data = reinterpret_cast<const char*>(sqlite3_column_text(statement_, column));
  return {data != nullptr ? data : "", static_cast<std::size_t>(sqlite3_column_bytes(statement_, column))};
}

std::span<const std::byte> Statement::blob(int column) const {
  const auto* data = static_cast<const std::byte*>(sqlite3_column_blob(statement_, column));
  return {data, static_cast<std::size_t>(sqlite3_column_bytes(statement_, column))};
}

Transaction::Transaction(const Database& database, Wait wait) : database_(database) {
  sqlite3* handle = database_.handle();
  if (wait == Wait::kNot) sqlite3_busy_timeout(handle, 0);
  const int code = sqlite3_exec(handle, "BEGIN IMMEDIATE", nullptr, nullptr, nullptr);
  if (wait == Wait::kNot) sqlite3_busy_timeout(handle, kPatience_ms);
  open_ = code == SQLITE_OK;
  if (!open_ && (wait == Wait::kAsUsual || (code & 0xFF) != SQLITE_BUSY)) fail(handle, code);
}

Transaction::~Transaction() {
  if (open_ && sqlite3_get_autocommit(database_.handle()) == 0) {
    sqlite3_exec(database_.handle(), "ROLLBACK", nullptr, nullptr, nullptr);
  }
}

void Transaction::commit() {
  Statement(database_, "COMMIT").run();
  open_ = false;
}

JoinedTransaction::JoinedTransaction(const Database& database) {
  if (sqlite3_get_autocommit(database.handle()) != 0) own_.emplace(database);
}

void JoinedTransaction::commit() {
  if (own_) own_->commit();
}

std::int64_t as_sql(std::uint64_t value) {
  return static_cast<std::int64_t>(std::min<std::uint64_t>(value, std::numeric_limits<std::int64_t>::max()));
}

std::uint64_t from_sql(std::int64_t value) { return static_cast<std::uint64_t>(value); }

}  // namespace tunnelrig
