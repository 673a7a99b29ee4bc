#include "dem_offline/campaign/run_index.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <sqlite3.h>
#include <sys/stat.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <set>
#include <stdexcept>
#include <utility>

#include "proto/records/os/regular_file.h"
#include "proto/records/run_file.h"

namespace grouser::campaign {
namespace {

constexpr std::array<const char*, 6> kOutputs = {"f_x", "f_y", "f_z", "torque", "m_z", "sinkage"};
constexpr int kSchema = 2;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

constexpr char kTable[] =
    "CREATE TABLE IF NOT EXISTS runs (run_id TEXT PRIMARY KEY, file TEXT, stamp TEXT,"
    " reason TEXT, wall_s REAL, summary BLOB)";  // a RunSummary

// The file is no index, or an old or broken one: it may be set aside.
struct UnusableIndex : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// What tells that a file was changed: size and time.
std::string StampOf(const std::string& path) {
  struct stat info {};
  if (stat(path.c_str(), &info) != 0) return "";
  return fmt::format("{} {}", info.st_size,
                     info.st_mtim.tv_sec * 1'000'000'000LL + info.st_mtim.tv_nsec);
}

SQLite::Database OpenIndex(const std::string& path) {
  constexpr int kBusyMs = 10'000;
  try {
    SQLite::Database db = os::OpenDatabase(path, kBusyMs);
    if (sqlite3_db_readonly(db.getHandle(), "main") == 1) {
      throw std::runtime_error(path + ": cannot be written");
    }
    if (db.execAndGet("PRAGMA quick_check(1)").getString() != "ok") {
      throw UnusableIndex(path + ": damaged index");
    }
    const int found = db.execAndGet("PRAGMA user_version").getInt();
    if (found != 0 && found != kSchema) {
      throw UnusableIndex(fmt::format("{}: index of schema {}, expected {}", path, found, kSchema));
    }
    db.exec(kTable);
    db.exec(fmt::format("PRAGMA user_version={}", kSchema));
    return db;
  } catch (const SQLite::Exception& error) {
    const int code = error.getErrorCode();
    if (code == SQLITE_NOTADB || code == SQLITE_CORRUPT) throw UnusableIndex(error.what());
    throw;
  }
}

// An index that cannot be used is set aside; where the folder cannot be written,
// the index lives in memory.
SQLite::Database OpenOrReplace(const std::string& path) {
  namespace fs = std::filesystem;
  try {
    if (fs::exists(path) && !fs::is_regular_file(path)) {
      spdlog::warn("{}: not a regular file; set aside as {}", path, os::SetAside(path));
    }
    try {
      return OpenIndex(path);
    } catch (const UnusableIndex& error) {
      spdlog::warn("{}; set aside as {}; rebuilding the index", error.what(), os::SetAside(path));
      fs::remove(path + "-journal");  // of the file that was set aside: would damage the new one
      return OpenIndex(path);
    }
  } catch (const std::exception& error) {
    spdlog::debug("{}; keeping the index in memory", error.what());
    return OpenIndex(":memory:");
  }
}

}  // namespace

IndexedRun IndexRunFile(const std::string& path) {
  IndexedRun run;
  run.stamp = StampOf(path);  // before it is read: a later change is then seen
  const auto record = records::ReadRunFile(path).record;
  auto& summary = run.summary;
  summary.set_run_id(record.run_id());
  summary.set_file(std::filesystem::path(path).filename().string());
  summary.set_sha256(records::Sha256OfFile(path));
  summary.set_status(record.status());
  summary.set_slip(record.slip());
  summary.set_attack_angle_rad(record.attack_angle_rad());
  summary.set_load_n(record.spec().state().load_n());
  summary.set_speed_m_per_s(record.spec().rig().speed_m_per_s());
  summary.set_seed(record.spec().seed());
  summary.set_travel_m(record.travel_m());
  run.reason = record.reason();
  run.wall_s = record.numerics().wall_s();
  for (const char* name : kOutputs) {
    double mean = kNan, error = kNan;
    for (const auto& output : record.outputs()) {
      if (output.name() != name) continue;
      mean = output.mean();
      error = output.standard_error();
    }
    summary.add_mean(mean);
    summary.add_standard_error(error);
  }
  return run;
}

RunIndex::RunIndex(const RunFolder& folder)
    : folder_(folder), db_(OpenOrReplace(folder_.IndexPath())) {}

void RunIndex::Put(const IndexedRun& run) {
  SQLite::Statement insert(db_, "INSERT OR REPLACE INTO runs VALUES (?,?,?,?,?,?)");
  SQLite::bind(insert, run.summary.run_id(), run.summary.file(), run.stamp, run.reason, run.wall_s);
  const std::string summary = run.summary.SerializeAsString();
  insert.bind(6, summary.data(), static_cast<int>(summary.size()));
  insert.exec();
}

std::map<std::string, std::string> RunIndex::Refresh() {
  std::map<std::string, std::string> unreadable;
  std::map<std::string, std::string> known;  // file -> stamp
  for (const auto& [id, run] : All()) known[run.summary.file()] = run.stamp;
  std::set<std::string> present;
  for (const std::string& name : folder_.RunFiles()) {
    const std::string path = folder_.path() + "/runs/" + name;
    present.insert(name);
    const auto found = known.find(name);
    if (found != known.end() && found->second == StampOf(path)) continue;
    try {
      Put(IndexRunFile(path));
    } catch (const SQLite::Exception&) {
      throw;
    } catch (const std::exception& error) {
      unreadable[name] = error.what();
      present.erase(name);
    }
  }
  for (const auto& [file, stamp] : known) {
    if (present.count(file)) continue;
    SQLite::Statement erase(db_, "DELETE FROM runs WHERE file = ?");
    erase.bind(1, file);
    erase.exec();
  }
  return unreadable;
}

std::map<std::string, IndexedRun> RunIndex::All() {
  std::map<std::string, IndexedRun> runs;
  SQLite::Statement select(db_, "SELECT run_id, stamp, reason, wall_s, summary FROM runs");
  while (select.executeStep()) {
    IndexedRun& run = runs[select.getColumn(0).getString()];
    run.stamp = select.getColumn(1).getString();
    run.reason = select.getColumn(2).getString();
    run.wall_s = os::NumberOf(select.getColumn(3));
    run.summary.ParseFromString(select.getColumn(4).getString());
  }
  return runs;
}

std::map<std::string, std::string> RunIndex::Rebuild(const RunFolder& folder) {
  folder.RunFiles();  // throws before anything is removed
  RunIndex index(folder);
  index.db_.exec("DELETE FROM runs");
  return index.Refresh();
}

}  // namespace grouser::campaign
