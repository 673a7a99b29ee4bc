#pragma once

#include <map>
#include <string>

#include "dem_offline/campaign/run_folder.h"
#include "grouser/v1alpha1/model.pb.h"

struct sqlite3;

namespace grouser::campaign {

/// One indexed run; `role` of the summary is not kept here (campaign.json says
/// it).
struct IndexedRun {
  v1alpha1::RunSummary summary;
  std::string reason;
  double wall_s = 0;
  std::int64_t file_size = 0;
  std::int64_t file_mtime_ns = 0;
};

/// What fits and lists need of a run, from its file.
IndexedRun IndexRunFile(const std::string& path);

/// SQLite index of a campaign folder's run files: private, and worth nothing
/// without them. Rollback journal, synchronous=EXTRA (SQLite 3.40 has the
/// WAL-reset bug; FULL does not sync the folder). One thread at a time.
class RunIndex {
 public:
  /// Opens or creates. A file that is no usable index is rebuilt. Where the
  /// folder cannot be written, the index lives in memory.
  explicit RunIndex(const RunFolder& folder);
  RunIndex(const RunIndex&) = delete;
  RunIndex& operator=(const RunIndex&) = delete;
  ~RunIndex();

  void Put(const IndexedRun& run);
  /// Reads run files that are new or changed, forgets those that are gone.
  /// Files that cannot be read are returned with the reason.
  std::map<std::string, std::string> Refresh();
  /// All rows, by run id.
  std::map<std::string, IndexedRun> All() const;

  /// Throws everything away and reads all run files again.
  static std::map<std::string, std::string> Rebuild(const RunFolder& folder);

 private:
  void Open(const std::string& path);
  void Execute(const char* sql) const;
  [[noreturn]] void Fail(const std::string& what) const;

  RunFolder folder_;
  std::string path_;
  sqlite3* db_ = nullptr;
};

}  // namespace grouser::campaign
