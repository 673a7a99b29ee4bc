#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "server/jobs/job_store.h"

namespace grouser::server {

/// One that nobody has; not yet anywhere.
std::string NewJobId();

/// What becomes of the retries that a job has had, where it is queued again.
enum class Retries { kKeep, kOneMore, kNone };

/// Who asks for what, and where each job stands: idempotent submission,
/// joining, withdrawal, the state machine, leases. Knows no process, no file
/// but the store's. One thread.
///
/// Every change is stored first and published after; where storing throws
/// (SqliteError), nothing has changed, or the book has what the store has. Only progress within a
/// stage is kept in memory alone.
class JobBook {
 public:
  using Clock = std::function<double()>;  ///< Unix time [s]
  using Listener = std::function<void(const v1alpha1::Job&)>;

  /// Loads all open jobs. `listener` hears every published change.
  /// `max_queued`: of one client; of all kMostClients times as many, but a client of
  /// whom no job waits is never refused.
  JobBook(JobStore& store, std::size_t max_queued, Clock clock, Listener listener);
  static constexpr std::size_t kMostClients = 16;

  /// The answer given before to this request_id, if any; throws
  /// StatusError(kAlreadyExists) where it then asked for something else. `content`: see ContentOf.
  std::optional<v1alpha1::SubmitJobResponse> Replay(const std::string& request_id,
                                                    const std::string& content);

  /// Joins an open job of equal work or makes one; on disk when it returns. `fresh`: join_key,
  /// spec, and of the job what is asked for; a job_id where its folder is there already. Throws
  /// StatusError(kResourceExhausted).
  v1alpha1::SubmitJobResponse Submit(const std::string& request_id, const std::string& content,
                                     JobRow fresh, const std::string& who);

  /// Throws StatusError(kNotFound).
  v1alpha1::Job Get(const std::string& job_id);
  /// A page, newest first, without stress and surface profiles. Throws
  /// StatusError(kInvalidArgument) for a negative size or a token that no page gave.
  v1alpha1::ListJobsResponse List(const v1alpha1::ListJobsRequest& request);

  /// Withdraws a subscription; the job is CANCELLED when none is left. Of an
  /// ended job or a withdrawn subscription: no change. Throws
  /// StatusError(kNotFound).
  v1alpha1::Job Cancel(const std::string& job_id, const std::string& request_id);

  // Rows are handed out as copies: every change replaces the book's own row,
  // and a reference to it would outlive what it refers to.
  /// The QUEUED job whose turn it is: of the client for whom the fewest workers run, then who
  /// waited longest for a turn; of that client the one of the highest priority, then the oldest. Of
  /// none of `but`.
  std::optional<JobRow> NextQueued(const std::set<std::string>& but = {}) const;
  std::optional<JobRow> FindOpen(const std::string& job_id) const;
  /// All open jobs, oldest first.
  std::vector<JobRow> Open() const { return open_; }

  enum class Publish { kYes, kNo };
  /// Applies `edit` to an open job under the lease `epoch`. Returns the row as
  /// it is now; nothing, and nothing happens, where the job has ended or its
  /// lease has another epoch: a stale worker's result. Throws std::logic_error
  /// for a move that the state machine does not have.
  std::optional<JobRow> Change(const std::string& job_id, std::uint64_t epoch,
                               const std::function<void(JobRow&)>& edit,
                               Publish publish = Publish::kYes);

  /// Progress of the running stage, in memory and to listeners only.
  /// eta_s: NaN where unknown.
  bool Progress(const std::string& job_id, std::uint64_t epoch, double fraction, double eta_s,
                const std::string& message);

  /// Back to QUEUED with the next lease epoch, without candidate.
  bool Requeue(const std::string& job_id, std::uint64_t epoch, const std::string& message,
               Retries retries);

 private:
  JobRow* Find(const std::string& job_id);
  void CheckQueue(const std::string& client) const;
  void Touch(JobRow& row) const;
  template <typename Write>
  auto Storing(const std::string& job_id, const Write& write);
  /// Takes over a stored row: replaces or drops the open one, tells listeners.
  void Adopt(JobRow row, Publish publish);

  JobStore& store_;
  std::size_t max_queued_;
  Clock clock_;
  Listener listener_;
  std::vector<JobRow> open_;                    ///< oldest first
  std::map<std::string, std::uint64_t> turns_;  ///< by client: when one of its jobs last started
  std::uint64_t turn_ = 0;
};

}  // namespace grouser::server
