#pragma once

#include <SQLiteCpp/SQLiteCpp.h>
#include <SQLiteCpp/VariadicBind.h>

#include <string>

namespace grouser::os {

/// Opens or creates a SQLite database for one thread: rollback journal and
/// synchronous=EXTRA (SQLite 3.40.1 has the WAL-reset bug, and FULL does not sync
/// the folder after the journal is removed, so that a power cut could undo a
/// commit), foreign keys enforced. `busy_ms`: how long to wait for another
/// program that looks into it. Throws SQLite::Exception "PATH: cause".
SQLite::Database OpenDatabase(const std::string& path, int busy_ms = 1000);

/// SQLite stores NaN as NULL: NaN for NULL.
double NumberOf(const SQLite::Column& column);

}  // namespace grouser::os
