// SQLite, wrapped as thinly as exceptions and RAII allow. Private to datasets/: nothing else knows SQL.
#pragma once

#include "datasets/error.h"

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>

#include <sqlite3.h>

namespace tunnelrig {

class Database;

/// A prepared statement: bind in order, step, read columns in order. Reusable after reset. The connection
/// keeps it compiled for the next one with the same text.
class Statement {
 public:
  Statement(const Database& database, std::string_view sql);
  ~Statement();
  Statement(Statement&& other) noexcept;
  Statement& operator=(Statement&&) = delete;
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;

  Statement& bind(std::int64_t value);
  Statement& bind(double value);
  Statement& bind(std::optional<double> value);
  Statement& bind(std::string_view value);            // copied
  Statement& bind(std::span<const std::byte> value);  // not copied: must live until the step

  bool step();  // true: a row stands ready
  void run();   // for statements without rows; resets, so that it can be bound again
  void reset();

  std::int64_t integer(int column) const;
  double real(int column) const;
  std::optional<double> maybe_real(int column) const;
  std::string text(int column) const;
  std::span<const std::byte> blob(int column) const;  // until the next step

 private:
  void check(int code) const;

  const Database* database_ = nullptr;
  sqlite3_stmt* statement_ = nullptr;
  int next_ = 1;
};

/// A connection.
class Database {
 public:
  Database(const std::string& path, int flags);
  ~Database();
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;

  void execute(const std::string& sql) const;
  std::string scalar(const std::string& sql) const;  // first column of the first row, as text
  std::int64_t scalar_integer(const std::string& sql) const;
  std::int64_t last_id() const;
  sqlite3* handle() const { return handle_; }

 private:
  friend class Statement;
  sqlite3_stmt* take(std::string_view sql) const;
  void give_back(sqlite3_stmt* statement) const;

  sqlite3* handle_ = nullptr;
  mutable std::unordered_map<std::string, sqlite3_stmt*> compiled_;  // those that nobody uses now
};

/// BEGIN IMMEDIATE … COMMIT; rolled back unless committed.
class Transaction {
 public:
  enum class Wait { kAsUsual, kNot };

  /// Not open where another connection is writing: for long, or at all (kNot). The former throws.
  explicit Transaction(const Database& database, Wait wait = Wait::kAsUsual);
  ~Transaction();
  Transaction(const Transaction&) = delete;
  Transaction& operator=(const Transaction&) = delete;
  void commit();
  bool open() const { return open_; }

 private:
  const Database& database_;
  bool open_ = true;
};

/// A transaction of its own, unless one is open already, whose owner then commits.
class JoinedTransaction {
 public:
  explicit JoinedTransaction(const Database& database);
  void commit();

 private:
  std::optional<Transaction> own_;
};

/// SQLite's integers are signed; counts beyond them stay at the largest.
std::int64_t as_sql(std::uint64_t value);
std::uint64_t from_sql(std::int64_t value);

}  // namespace tunnelrig
