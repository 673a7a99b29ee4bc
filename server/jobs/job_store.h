#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "grouser/v1alpha1/jobs_service.pb.h"
#include "proto/records/os/database.h"

namespace grouser::server {

/// A statement of the store, or the disk below it, failed.
using SqliteError = SQLite::Exception;

/// A job as it is kept: the public message, and what only this program needs.
struct JobRow {
  v1alpha1::Job job;
  v1alpha1::WheelTestSpec spec;  ///< what the DEM worker runs, fixed at submission
  std::string join_key;          ///< equal keys: the same work
  int retries = 0;               ///< abnormal worker ends so far
  /// An alias move that was decided but may not have reached the alias file
  /// (job_id set). Redone at start-up: moves are idempotent.
  v1alpha1::PromoteRequest pending;
};

/// One client's request for a job.
struct RequestRow {
  std::string request_id;
  std::string job_id;
  std::string content;  ///< hash of what was asked
  bool joined = false;
  bool withdrawn = false;
};

/// Jobs and requests in SQLite: the one truth about jobs. Every call is one
/// transaction, on disk when it returns. One thread. Throws SqliteError.
class JobStore {
 public:
  /// Opens or creates; throws std::runtime_error for a schema that is newer.
  explicit JobStore(const std::string& path);

  void Insert(const JobRow& row, const RequestRow& request);
  /// A further subscriber: updates the job and adds the request.
  void Join(const JobRow& row, const RequestRow& request);
  /// Marks the subscription withdrawn and updates the job. False and no
  /// change where the stored lease epoch is not `held_epoch`.
  bool Withdraw(const JobRow& row, std::uint64_t held_epoch, const std::string& request_id);
  /// Updates the job. False and no change where the stored lease epoch is not
  /// `held_epoch`: the writer's lease was taken away.
  bool Save(const JobRow& row, std::uint64_t held_epoch);

  std::optional<RequestRow> FindRequest(const std::string& request_id);
  std::optional<JobRow> Find(const std::string& job_id);
  /// Subscriptions of a job that were not withdrawn.
  std::uint32_t CountSubscribers(const std::string& job_id);
  // One damaged row must not stop the others: the two below name it in the log
  // and pass it over; Find throws std::runtime_error.
  /// All that have not ended, oldest first.
  std::vector<JobRow> LoadOpen();
  /// Newest first, from the one submitted before `before` (a job's id; empty: the newest).
  /// nullopt where no such job is known.
  std::optional<std::vector<v1alpha1::Job>> List(std::size_t limit, const std::string& before = "");

  /// Every job with the bytes of its row, oldest first. Throws std::runtime_error for a
  /// damaged row.
  void ForEach(const std::function<void(const v1alpha1::Job&, std::uint64_t)>& visit);
  /// Forgets an ended job and its requests; of an open one, nothing.
  void Remove(const std::string& job_id);
  /// Gives the space of removed rows back to the disk, where it is worth it.
  void Compact();
  /// All that were ever submitted.
  std::map<v1alpha1::JobState, std::size_t> CountByState();

  static constexpr int kSchemaVersion = 1;

 private:
  void Migrate();
  std::vector<JobRow> ReadRows(SQLite::Statement& query, std::size_t limit = SIZE_MAX) const;
  void InsertRequest(const RequestRow& request);
  bool Update(const JobRow& row, std::uint64_t held_epoch);

  std::string Path() const { return db_.getFilename(); }

  SQLite::Database db_;
};

}  // namespace grouser::server
