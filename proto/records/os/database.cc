#include "proto/records/os/database.h"

#include <limits>

namespace grouser::os {

SQLite::Database OpenDatabase(const std::string& path, int busy_ms) {
  try {
    SQLite::Database db(path, SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE, busy_ms);
    db.exec("PRAGMA journal_mode=DELETE; PRAGMA synchronous=EXTRA; PRAGMA foreign_keys=ON");
    return db;
  } catch (const SQLite::Exception& e) {
    throw SQLite::Exception(path + ": " + e.what(), e.getErrorCode());
  }
}

double NumberOf(const SQLite::Column& column) {
  return column.isNull() ? std::numeric_limits<double>::quiet_NaN() : column.getDouble();
}

}  // namespace grouser::os
