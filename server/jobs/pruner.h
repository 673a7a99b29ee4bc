#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "server/core/repository.h"
#include "server/jobs/job_book.h"
#include "server/jobs/job_files.h"

namespace grouser::server {

inline constexpr double kDayS = 86400;

struct PruneLimits {
  std::uint64_t max_bytes = 0;  ///< of models, runs, tiles and jobs; 0: no limit
  double keep_s = 0;            ///< older than this goes; 0: no limit
  double settle_s = 3600;       ///< younger than this stays, whatever the limits
};

/// Of an alias this many latest moves keep what they lead from and to, and as many rollbacks what
/// they would lead to.
inline constexpr std::size_t kRollbacksKept = 10;

/// Removes what nothing names any more: ended jobs (row, requests, folder), models, runs and
/// tiles, the oldest first, until the limits hold. Kept are
/// - models that an alias names, or named in one of its kRollbacksKept latest moves, or that so
///   many rollbacks lead to ("candidate", which nobody rolls back, apart), and those of open jobs;
/// - of each of these the model that it was refitted from, and the runs in its provenance;
/// - runs of open jobs, and tiles while a worker runs;
/// - what this program did not make: among the models and runs all but files that are named so.
/// Killed at any moment it leaves rows whose files are there, and files that the next
/// pruning finds. On the thread of the store.
class Pruner {
 public:
  /// Removes a file or folder; throws std::runtime_error.
  using Remover = std::function<void(const std::string& path)>;

  Pruner(const JobFiles& files, JobStore& store, const JobBook& book, const Repository& repository,
         Remover remove = RemoveAll);

  /// Throws std::runtime_error, and removes nothing, where what names things cannot be read: the
  /// alias file, a model that must be kept, a job's row. What cannot be removed is left, logged and
  /// reported.
  v1alpha1::PruneResponse Prune(const PruneLimits& limits, bool dry_run, double now_unix_s);

  static void RemoveAll(const std::string& path);

 private:
  /// Why it could not be done; empty: done. `job_id`: whose row goes first.
  std::string Remove(const std::string& path, const std::string& job_id);

  const JobFiles& files_;
  JobStore& store_;
  const JobBook& book_;
  const Repository& repository_;
  Remover remove_;
};

}  // namespace grouser::server
