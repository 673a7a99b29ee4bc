#include "server/jobs/sqlite.h"

namespace grouser::server {
namespace {

[[noreturn]] void Fail(const Database& db, const std::string& what) {
  throw SqliteError(db.path() + ": " + what + ": " + sqlite3_errmsg(db.handle()),
                    sqlite3_extended_errcode(db.handle()));
}

}  // namespace

Database::Database(const std::string& path) : path_(path) {
  const int rc =
      sqlite3_open_v2(path.c_str(), &db_, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE, nullptr);
  if (rc != SQLITE_OK) {
    const std::string cause = db_ != nullptr ? sqlite3_errmsg(db_) : "out of memory";
    sqlite3_close(db_);
    throw SqliteError(path + ": cannot be opened: " + cause, rc);
  }
  try {
    sqlite3_busy_timeout(db_, 1000);  // someone looks into it by hand
    Exec("PRAGMA journal_mode=DELETE");
    Exec("PRAGMA synchronous=EXTRA");
    Exec("PRAGMA foreign_keys=ON");
  } catch (...) {
    sqlite3_close(db_);
    throw;
  }
}

Database::~Database() { sqlite3_close(db_); }

void Database::Exec(const std::string& sql) {
  if (sqlite3_exec(db_, sql.c_str(), nullptr, nullptr, nullptr) != SQLITE_OK) Fail(*this, sql);
}

Statement::Statement(Database& db, const std::string& sql) : db_(db) {
  if (sqlite3_prepare_v2(db.handle(), sql.c_str(), -1, &statement_, nullptr) != SQLITE_OK) {
    Fail(db, sql);
  }
}

Statement::~Statement() { sqlite3_finalize(statement_); }

Statement& Statement::Text(int index, const std::string& value) {
  if (sqlite3_bind_text64(statement_, index, value.data(), value.size(), SQLITE_TRANSIENT,
                          SQLITE_UTF8) != SQLITE_OK) {
    Fail(db_, "bind");
  }
  return *this;
}

Statement& Statement::Blob(int index, const std::string& value) {
  if (sqlite3_bind_blob64(statement_, index, value.data(), value.size(), SQLITE_TRANSIENT) !=
      SQLITE_OK) {
    Fail(db_, "bind");
  }
  return *this;
}

Statement& Statement::Int(int index, std::int64_t value) {
  if (sqlite3_bind_int64(statement_, index, value) != SQLITE_OK) Fail(db_, "bind");
  return *this;
}

bool Statement::Step() {
  const int rc = sqlite3_step(statement_);
  if (rc == SQLITE_ROW) return true;
  if (rc != SQLITE_DONE) Fail(db_, sqlite3_sql(statement_));
  return false;
}

std::string Statement::ColumnBytes(int column) const {
  const void* bytes = sqlite3_column_blob(statement_, column);
  const int size = sqlite3_column_bytes(statement_, column);
  return bytes == nullptr ? std::string() : std::string(static_cast<const char*>(bytes), size);
}

std::int64_t Statement::ColumnInt(int column) const {
  return sqlite3_column_int64(statement_, column);
}

Transaction::~Transaction() {
  // A failed rollback has nothing left to undo: SQLite rolls back by itself
  // after the errors that end a transaction.
  if (open_) sqlite3_exec(db_.handle(), "ROLLBACK", nullptr, nullptr, nullptr);
}

void Transaction::Commit() {
  db_.Exec("COMMIT");
  open_ = false;
}

}  // namespace grouser::server
