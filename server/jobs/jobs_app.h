#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "proto/records/os/unique_fd.h"
#include "server/core/metric_page.h"
#include "server/core/repository.h"
#include "server/jobs/intake.h"
#include "server/jobs/job_book.h"
#include "server/jobs/job_files.h"
#include "server/jobs/pruner.h"
#include "server/jobs/scheduler.h"
#include "server/jobs/serial_thread.h"
#include "server/jobs/watch_hub.h"
#include "server/jobs/worker_pool.h"

namespace grouser::server {

struct JobsOptions {
  std::string state_dir, shipped_dir;
  std::size_t max_queued = 64;
  double grace_s = 5.0;  ///< from SIGTERM to SIGKILL of a worker
  SchedulerOptions scheduler;
  PruneLimits prune;
  double prune_every_s = 600;
};

/// Everything behind the service. Requests (below "Requests") run on thread()
/// and throw StatusError or SqliteError.
class JobsApp {
 public:
  /// Throws std::runtime_error where the state folder cannot be used, or is
  /// in use by another jobs program.
  JobsApp(JobsOptions options, boost::asio::io_context& loop);

  /// Takes up what an earlier life left, starts workers. Any thread but
  /// thread(); returns when that is done. A job that cannot be taken up is
  /// FAILED or tried again later; the others go on.
  void Start();
  /// Refuses requests from now on, stops workers (their jobs stay resumable),
  /// ends watches, then calls `done` on thread(). Any thread.
  void Stop(std::function<void()> done);

  SerialThread& thread() { return thread_; }

  // Asked on any thread, told on thread(): what that has not the time to say is not said.
  /// Why requests are not answered: the job store cannot be read, or the program stops.
  void TellReadiness(std::function<void(std::vector<std::string>)> tell);
  void TellMetrics(std::function<void(MetricPage)> tell);

  // Requests. `who`: the caller, as AccessPolicy knows it; whose share of queue and workers a job
  // takes.
  v1alpha1::SubmitRefinementResponse Submit(const v1alpha1::SubmitRefinementRequest& request,
                                            const std::string& who);
  /// A campaign or calibration: calls `done` on thread(), maybe before it returns; see Intake.
  void SubmitWork(WorkRequest request, const std::string& who, Intake::Done done);
  v1alpha1::ReadJobFileResponse ReadFile(const v1alpha1::ReadJobFileRequest& request);
  v1alpha1::GetJobResponse Get(const v1alpha1::GetJobRequest& request);
  v1alpha1::ListJobsResponse List(const v1alpha1::ListJobsRequest& request) {
    return book_.List(request);
  }
  v1alpha1::CancelJobResponse Cancel(const v1alpha1::CancelJobRequest& request);
  /// What the request calls itself is recorded after `who`, as what it says.
  v1alpha1::PromoteResponse Promote(const v1alpha1::PromoteRequest& request,
                                    const std::string& who);
  v1alpha1::MoveAliasResponse Move(const v1alpha1::MoveAliasRequest& request,
                                   const std::string& who);
  v1alpha1::MoveAliasResponse Rollback(const v1alpha1::RollbackAliasRequest& request,
                                       const std::string& who);
  v1alpha1::ListAliasMovesResponse ListMoves(const v1alpha1::ListAliasMovesRequest& request);
  v1alpha1::PruneResponse Prune(const v1alpha1::PruneRequest& request);
  /// Tells the watcher the present state, then every change.
  void Watch(const v1alpha1::WatchJobRequest& request, const std::shared_ptr<JobWatcher>& watcher);

 private:
  void RefuseWhenStopping() const;
  void CheckPromotable(const v1alpha1::Job& job, const v1alpha1::PromoteRequest& request,
                       const std::string& alias) const;
  /// So that what is asked now of a model comes after what was decided of it before, but by job
  /// `but`.
  void FinishDecidedMoves(const std::string& model, const std::string& but = "");
  v1alpha1::PruneResponse PruneTo(const PruneLimits& limits, bool dry_run);
  void EndWhatNobodyPromotes(double keep_s);
  void PruneEvery(double seconds);

  PruneLimits prune_;
  double prune_every_s_;
  JobFiles files_;
  os::UniqueFd instance_lock_;
  Repository repository_;
  WatchHub hub_;
  std::map<v1alpha1::JobState, std::uint64_t> ended_;  ///< jobs, since the program started
  JobStore store_;
  JobBook book_;
  Pruner pruner_;
  WorkerPool pool_;
  Intake intake_;
  bool stopping_ = false;
  std::unique_ptr<Scheduler> scheduler_;
  SerialThread thread_;  ///< last: ends first, while all it uses is there
};

}  // namespace grouser::server
