#pragma once

#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>

#include "server/core/repository.h"
#include "server/jobs/job_book.h"
#include "server/jobs/job_files.h"
#include "server/jobs/known_models.h"
#include "server/jobs/refit_plan.h"
#include "server/jobs/serial_thread.h"
#include "server/jobs/work_command.h"
#include "server/jobs/worker_pool.h"
#include "surrogate/model_io/gate_limits.h"

namespace grouser::server {

struct SchedulerOptions {
  std::string bin_dir;         ///< holds grouser-dem, grouser-fit, grouser-calibrate; absolute
  int workers = 1;             ///< processes at a time
  std::string device = "cpu";  ///< of DEM runs: cpu, cuda, auto
  WorkerLimits limits;
  WorkOptions work;  ///< campaigns and calibrations
  double dem_timeout_s = 6 * 3600;
  double fit_timeout_s = 3600;
  /// Alias that a candidate which passes the gate gets by itself; empty: a person promotes.
  std::string auto_promote;
  surrogate::GateLimits gate;  ///< what the gate judges by
  double retry_s = 5;          ///< until a step that the store refused is tried again
};

/// Carries jobs through their stages, each a worker process. Campaigns and calibrations have one,
/// RUNNING, whose program goes on by itself in the job's folder; refinements three:
///   RUNNING     grouser-dem run    -> run.h5, published as runs/RUNID.run.h5
///   FITTING     grouser-fit refit  -> candidate.model, of what stable is then, with the runs of
///                                     other candidates of it
///   VALIDATING  grouser-fit gate   -> checks; then published, alias candidate
/// Order at each step: artefact, row, alias; so whatever moment a crash
/// chooses, start-up finds a row that an artefact can only be ahead of, and
/// adopts it by content. All members run on the serial thread.
class Scheduler {
 public:
  Scheduler(SchedulerOptions options, const JobFiles& files, JobBook& book, Repository& repository,
            WorkerPool& pool, SerialThread& thread);

  /// After a start: ends left-over workers, requeues what they were at,
  /// finishes alias moves that were decided.
  void Recover();
  /// Starts queued jobs while workers are free.
  void Kick();
  /// Stops the worker of a job that was cancelled.
  void StopWorker(const std::string& job_id);
  /// Requeues running work, stops all workers, then calls `done`.
  void Stop(std::function<void()> done);

  /// Carries out an alias move that a job's row decided. Throws what the
  /// repository throws. Returns the repository's generation.
  std::uint64_t FinishPendingMove(const std::string& job_id);
  /// The same after a while, and again until it is done.
  void FinishMoveLater(const std::string& job_id);
  /// After this call: of the jobs that await promotion and refine `model`'s stable, those that were
  /// fitted from another one than stable is now are fitted again, or DONE where it has their run.
  /// Tried again until it is done.
  void FollowStable(const std::string& model);

 private:
  struct Active {
    std::uint64_t epoch = 0;
    double started_s = 0;     ///< of the stage, on a steady clock
    std::string stop_reason;  ///< why it was told to end; empty: it was not
    /// Of a fit: further runs that the candidate must have.
    std::set<std::string> run_ids = {};
  };
  /// A worker's end, and what it was at.
  struct Ended {
    std::string job_id;
    std::uint64_t epoch = 0;
    v1alpha1::JobState stage = v1alpha1::JOB_STATE_UNSPECIFIED;
    WorkerEnd end;
    std::string stop_reason;
    std::set<std::string> run_ids = {};
  };
  enum class Retry { kNo, kOnce };
  static constexpr double kLongestRetryS = 300;

  /// Starts whatever the job's state asks for; where that is done already, by
  /// an earlier life of this program, goes on.
  void Continue(const std::string& job_id);
  void Launch(const JobRow& row, std::vector<std::string> argv, double timeout_s);
  void LaunchRun(const JobRow& row);
  void LaunchFit(const JobRow& row);
  void LaunchGate(const JobRow& row);
  void LaunchWork(const JobRow& row);
  /// Ends a worker whose job's folder has grown beyond its limit.
  void WatchDisk(const std::string& job_id, std::uint64_t epoch);

  void OnProgress(const std::string& job_id, std::uint64_t epoch, const ProgressLine& line);
  void OnEnd(Ended ended);
  void Conclude(const Ended& ended);
  void ConcludeFit(const JobRow& row, const Ended& ended);
  void ConcludeGate(const JobRow& row);
  void AcceptRun(const JobRow& row, const FinishedRun& run);
  void AcceptWork(const JobRow& row);
  /// The job with the base that it is to be fitted from; none where that has its run already, which
  /// ends the job, or its lease is over.
  std::optional<JobRow> OnPresentBase(const JobRow& row);
  /// Queues a job again whose candidate is of a base that stable has left, or, where `with_others`,
  /// lacks runs of other candidates.
  bool FitAgain(const JobRow& row, bool with_others);
  void EndAsContained(const JobRow& row, const std::string& digest);
  void FollowStableNow(const std::string& model, double retry_s);
  Companions CompanionsFor(const JobRow& row, const std::set<std::string>& left_out);
  /// Queues a job again for a fit without the runs of others, with which it came to nothing.
  void FitAlone(const JobRow& row, const std::string& why);
  void AcceptCandidate(const JobRow& row, const std::string& message);
  void EndAbnormally(const std::string& job_id, std::uint64_t epoch, const std::string& why,
                     Retry retry);
  /// The move after the one to "candidate", where the gate alone decides.
  v1alpha1::PromoteRequest NextMove(const v1alpha1::Job& job) const;
  void RetryPendingMove(const std::string& job_id, double retry_s);
  void RecoverJob(const JobRow& row);

  /// Runs a step of a job. A store that fails and a full disk leave the job as it
  /// was: the step is tried again later. Any other error ends the job.
  void Guarded(const std::string& job_id, std::uint64_t epoch, std::function<void()> step);
  void TryLater(const std::string& job_id, std::uint64_t epoch, std::function<void()> step,
                const std::string& why);

  WorkPrograms Programs() const { return {options_.bin_dir, options_.device, options_.work}; }

  SchedulerOptions options_;
  const JobFiles& files_;
  JobBook& book_;
  Repository& repository_;
  KnownModels models_{repository_};
  WorkerPool& pool_;
  SerialThread& thread_;
  std::map<std::string, Active> active_;
  std::set<std::string>
      waiting_;  ///< jobs with a step to be tried again: each keeps a worker's place
  /// By job: what planning its latest fit has passed over.
  std::map<std::string, std::set<std::string>> passed_over_;
  std::set<std::string> following_;  ///< models whose candidates are to be looked at again
  bool stopping_ = false;
  std::function<void()> stopped_;
};

}  // namespace grouser::server
