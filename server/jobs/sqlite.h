#pragma once

#include <sqlite3.h>

#include <cstdint>
#include <stdexcept>
#include <string>

namespace grouser::server {

/// A statement or the disk below it failed. `Full()`: no space left.
class SqliteError : public std::runtime_error {
 public:
  SqliteError(const std::string& message, int code) : std::runtime_error(message), code_(code) {}
  bool Full() const { return (code_ & 0xff) == SQLITE_FULL; }

 private:
  int code_;
};

/// One connection, used by one thread. Rollback journal and synchronous=EXTRA:
/// SQLite 3.40.1 has the WAL-reset bug, and FULL does not sync the folder after
/// the journal is removed, so a commit could be undone by a power cut.
class Database {
 public:
  explicit Database(const std::string& path);
  ~Database();
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;

  void Exec(const std::string& sql);
  sqlite3* handle() const { return db_; }
  const std::string& path() const { return path_; }
  int Changes() const { return sqlite3_changes(db_); }

 private:
  std::string path_;
  sqlite3* db_ = nullptr;
};

/// A prepared statement; parameters are bound by position from 1.
class Statement {
 public:
  Statement(Database& db, const std::string& sql);
  ~Statement();
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;

  Statement& Text(int index, const std::string& value);
  Statement& Blob(int index, const std::string& value);
  Statement& Int(int index, std::int64_t value);
  /// True: a row is there. Throws SqliteError.
  bool Step();
  std::string ColumnBytes(int column) const;
  std::int64_t ColumnInt(int column) const;

 private:
  Database& db_;
  sqlite3_stmt* statement_ = nullptr;
};

/// Rolls back unless committed.
class Transaction {
 public:
  explicit Transaction(Database& db) : db_(db) { db_.Exec("BEGIN IMMEDIATE"); }
  ~Transaction();
  Transaction(const Transaction&) = delete;
  Transaction& operator=(const Transaction&) = delete;
  void Commit();

 private:
  Database& db_;
  bool open_ = true;
};

}  // namespace grouser::server
