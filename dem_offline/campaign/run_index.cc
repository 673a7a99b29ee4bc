#include "dem_offline/campaign/run_index.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <sqlite3.h>
#include <sys/stat.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <memory>
#include <set>
#include <stdexcept>
#include <utility>

#include "proto/records/run_file.h"

namespace grouser::campaign {
namespace {

constexpr std::array<const char*, 6> kOutputs = {"f_x", "f_y", "f_z", "torque", "m_z", "sinkage"};
constexpr int kSchema = 1;
constexpr int kFirstMean = 13;  // column of the first mean
constexpr int kColumns = kFirstMean + 12;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

constexpr char kTable[] =
    "CREATE TABLE IF NOT EXISTS runs (run_id TEXT PRIMARY KEY, file TEXT, sha256 TEXT,"
    " status INTEGER, reason TEXT, slip REAL, attack_angle_rad REAL, load_n REAL,"
    " speed_m_per_s REAL, seed INTEGER, travel_m REAL, wall_s REAL, stat TEXT,"
    " f_x REAL, f_x_se REAL, f_y REAL, f_y_se REAL, f_z REAL, f_z_se REAL, torque REAL,"
    " torque_se REAL, m_z REAL, m_z_se REAL, sinkage REAL, sinkage_se REAL)";

using Statement = std::unique_ptr<sqlite3_stmt, int (*)(sqlite3_stmt*)>;

// The file is no index, or an old or broken one: it may be thrown away.
struct UnusableIndex : std::runtime_error {
  using std::runtime_error::runtime_error;
};

Statement Prepare(sqlite3* db, const std::string& sql) {
  sqlite3_stmt* statement = nullptr;
  // On failure the statement stays null, and the caller says what it was for.
  sqlite3_prepare_v2(db, sql.c_str(), -1, &statement, nullptr);
  return {statement, sqlite3_finalize};
}

void BindText(const Statement& statement, int at, const std::string& text) {
  sqlite3_bind_text(statement.get(), at, text.c_str(), -1, SQLITE_TRANSIENT);
}

std::string TextOf(const Statement& statement, int column) {
  const auto* text = reinterpret_cast<const char*>(sqlite3_column_text(statement.get(), column));
  return text ? text : "";
}

// SQLite stores NaN as NULL.
double NumberOf(const Statement& statement, int column) {
  return sqlite3_column_type(statement.get(), column) == SQLITE_NULL
             ? kNan
             : sqlite3_column_double(statement.get(), column);
}

void ReadStat(const std::string& path, IndexedRun* run) {
  struct stat info {};
  if (stat(path.c_str(), &info) != 0) return;
  run->file_size = info.st_size;
  run->file_mtime_ns = info.st_mtim.tv_sec * 1'000'000'000LL + info.st_mtim.tv_nsec;
}

std::string StatText(const IndexedRun& run) {
  return fmt::format("{} {}", run.file_size, run.file_mtime_ns);
}

IndexedRun RowOf(const Statement& row) {
  IndexedRun run;
  auto& summary = run.summary;
  summary.set_run_id(TextOf(row, 0));
  summary.set_file(TextOf(row, 1));
  summary.set_sha256(TextOf(row, 2));
  summary.set_status(static_cast<v1alpha1::RunStatus>(sqlite3_column_int(row.get(), 3)));
  run.reason = TextOf(row, 4);
  summary.set_slip(NumberOf(row, 5));
  summary.set_attack_angle_rad(NumberOf(row, 6));
  summary.set_load_n(NumberOf(row, 7));
  summary.set_speed_m_per_s(NumberOf(row, 8));
  summary.set_seed(static_cast<std::uint64_t>(sqlite3_column_int64(row.get(), 9)));
  summary.set_travel_m(NumberOf(row, 10));
  run.wall_s = NumberOf(row, 11);
  const std::string stat = TextOf(row, 12);
  const std::size_t space = stat.find(' ');
  if (space != std::string::npos) {
    run.file_size = std::stoll(stat.substr(0, space));
    run.file_mtime_ns = std::stoll(stat.substr(space + 1));
  }
  for (int i = 0; i < 6; ++i) {
    summary.add_mean(NumberOf(row, kFirstMean + 2 * i));
    summary.add_standard_error(NumberOf(row, kFirstMean + 2 * i + 1));
  }
  return run;
}

}  // namespace

IndexedRun IndexRunFile(const std::string& path) {
  IndexedRun run;
  ReadStat(path, &run);
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

RunIndex::RunIndex(const RunFolder& folder) : folder_(folder) {
  try {
    Open(folder_.IndexPath());
  } catch (const UnusableIndex& error) {
    spdlog::warn("{}; rebuilding the index", error.what());
    std::error_code ignored;
    std::filesystem::remove(folder_.IndexPath(), ignored);
    std::filesystem::remove(folder_.IndexPath() + "-journal", ignored);
    Open(folder_.IndexPath());
  } catch (const std::exception& error) {
    spdlog::debug("{}; keeping the index in memory", error.what());
    Open(":memory:");
  }
}

RunIndex::~RunIndex() { sqlite3_close(db_); }

void RunIndex::Fail(const std::string& what) const {
  const std::string text = fmt::format("{}: {}: {}", path_, what, sqlite3_errmsg(db_));
  const int code = sqlite3_errcode(db_);
  if (code == SQLITE_NOTADB || code == SQLITE_CORRUPT) throw UnusableIndex(text);
  throw std::runtime_error(text);
}

void RunIndex::Execute(const char* sql) const {
  if (sqlite3_exec(db_, sql, nullptr, nullptr, nullptr) != SQLITE_OK) Fail("index error");
}

void RunIndex::Open(const std::string& path) {
  sqlite3_close(std::exchange(db_, nullptr));
  path_ = path;
  if (sqlite3_open(path.c_str(), &db_) != SQLITE_OK) Fail("cannot open the index");
  if (sqlite3_db_readonly(db_, "main") == 1) {
    throw std::runtime_error(path + ": cannot be written");
  }
  sqlite3_busy_timeout(db_, 10'000);
  Execute("PRAGMA journal_mode=DELETE");
  Execute("PRAGMA synchronous=EXTRA");
  const Statement check = Prepare(db_, "PRAGMA quick_check(1)");
  if (!check || sqlite3_step(check.get()) != SQLITE_ROW) Fail("cannot check the index");
  if (TextOf(check, 0) != "ok") throw UnusableIndex(path + ": damaged index");
  const Statement version = Prepare(db_, "PRAGMA user_version");
  if (!version || sqlite3_step(version.get()) != SQLITE_ROW) Fail("cannot read the index");
  const int found = sqlite3_column_int(version.get(), 0);
  if (found != 0 && found != kSchema) {
    throw UnusableIndex(fmt::format("{}: index of schema {}, expected {}", path, found, kSchema));
  }
  Execute(kTable);
  Execute(fmt::format("PRAGMA user_version={}", kSchema).c_str());
}

void RunIndex::Put(const IndexedRun& run) {
  std::string places = "?";
  for (int i = 1; i < kColumns; ++i) places += ",?";
  const Statement insert =
      Prepare(db_, "INSERT OR REPLACE INTO runs VALUES (" + places + ")");
  if (!insert) Fail("cannot write the index");
  const auto& summary = run.summary;
  BindText(insert, 1, summary.run_id());
  BindText(insert, 2, summary.file());
  BindText(insert, 3, summary.sha256());
  sqlite3_bind_int(insert.get(), 4, summary.status());
  BindText(insert, 5, run.reason);
  sqlite3_bind_double(insert.get(), 6, summary.slip());
  sqlite3_bind_double(insert.get(), 7, summary.attack_angle_rad());
  sqlite3_bind_double(insert.get(), 8, summary.load_n());
  sqlite3_bind_double(insert.get(), 9, summary.speed_m_per_s());
  sqlite3_bind_int64(insert.get(), 10, static_cast<std::int64_t>(summary.seed()));
  sqlite3_bind_double(insert.get(), 11, summary.travel_m());
  sqlite3_bind_double(insert.get(), 12, run.wall_s);
  BindText(insert, 13, StatText(run));
  for (int i = 0; i < 6; ++i) {
    sqlite3_bind_double(insert.get(), kFirstMean + 2 * i + 1, summary.mean(i));
    sqlite3_bind_double(insert.get(), kFirstMean + 2 * i + 2, summary.standard_error(i));
  }
  if (sqlite3_step(insert.get()) != SQLITE_DONE) Fail("cannot write the index");
}

std::map<std::string, std::string> RunIndex::Refresh() {
  std::map<std::string, std::string> unreadable;
  std::map<std::string, std::string> known;  // file -> size and time
  for (const auto& [id, run] : All()) known[run.summary.file()] = StatText(run);
  std::set<std::string> present;
  for (const std::string& name : folder_.RunFiles()) {
    const std::string path = folder_.path() + "/runs/" + name;
    present.insert(name);
    IndexedRun now;
    ReadStat(path, &now);
    const auto found = known.find(name);
    if (found != known.end() && found->second == StatText(now)) continue;
    try {
      Put(IndexRunFile(path));
    } catch (const std::exception& error) {
      unreadable[name] = error.what();
      present.erase(name);
    }
  }
  for (const auto& [file, stat] : known) {
    if (present.count(file)) continue;
    const Statement erase = Prepare(db_, "DELETE FROM runs WHERE file = ?");
    if (!erase) Fail("cannot write the index");
    BindText(erase, 1, file);
    if (sqlite3_step(erase.get()) != SQLITE_DONE) Fail("cannot write the index");
  }
  return unreadable;
}

std::map<std::string, IndexedRun> RunIndex::All() const {
  std::map<std::string, IndexedRun> runs;
  const Statement select = Prepare(db_, "SELECT * FROM runs");
  if (!select) Fail("cannot read the index");
  int code = SQLITE_ROW;
  while ((code = sqlite3_step(select.get())) == SQLITE_ROW) {
    IndexedRun run = RowOf(select);
    runs[run.summary.run_id()] = std::move(run);
  }
  if (code != SQLITE_DONE) Fail("cannot read the index");
  return runs;
}

std::map<std::string, std::string> RunIndex::Rebuild(const RunFolder& folder) {
  folder.RunFiles();  // throws before anything is removed
  std::error_code ignored;
  std::filesystem::remove(folder.IndexPath(), ignored);
  std::filesystem::remove(folder.IndexPath() + "-journal", ignored);
  return RunIndex(folder).Refresh();
}

}  // namespace grouser::campaign
