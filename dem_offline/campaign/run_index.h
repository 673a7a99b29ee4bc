#pragma once

#include <map>
#include <string>

#include "dem_offline/campaign/run_folder.h"
#include "grouser/v1alpha1/model.pb.h"
#include "proto/records/os/database.h"

namespace grouser::campaign {

/// One indexed run; `role` of the summary is not kept here (campaign.json says
/// it).
struct IndexedRun {
  v1alpha1::RunSummary summary;
  std::string reason;
  double wall_s = 0;
  std::string stamp;  ///< of the file as it was read; another one: it was changed
};

/// What fits and lists need of a run, from its file.
IndexedRun IndexRunFile(const std::string& path);

/// SQLite index of a campaign folder's run files: private, and worth nothing
/// without them. One thread at a time. Throws SQLite::Exception.
class RunIndex {
 public:
  /// Opens or creates. What is no usable index is set aside. Where the
  /// folder cannot be written, the index lives in memory.
  explicit RunIndex(const RunFolder& folder);

  void Put(const IndexedRun& run);
  /// Reads run files that are new or changed, forgets those that are gone.
  /// Files that cannot be read are returned with the reason.
  std::map<std::string, std::string> Refresh();
  /// All rows, by run id.
  std::map<std::string, IndexedRun> All();

  /// Throws everything away and reads all run files again.
  static std::map<std::string, std::string> Rebuild(const RunFolder& folder);

 private:
  RunFolder folder_;
  SQLite::Database db_;
};

}  // namespace grouser::campaign
