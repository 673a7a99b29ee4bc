#include "server/jobs/jobs_app.h"

#include <fmt/core.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <future>
#include <stdexcept>
#include <utility>

#include "proto/records/os/file_lock.h"
#include "server/core/model_reference.h"
#include "server/core/status.h"
#include "server/jobs/alias_requests.h"
#include "server/jobs/job_state.h"
#include "server/jobs/refinement_spec.h"
#include "server/jobs/request_checks.h"
#include "server/jobs/scheduler_steps.h"
#include "surrogate/model_io/upgrade.h"

namespace grouser::server {
namespace {

constexpr std::uint64_t kMegabyte = 1'000'000;

double UnixNow() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

os::UniqueFd LockState(const std::string& path) {
  // On a machine with many times more to do than cores a killed program's last worker may take
  // more than kSpawnS to be spawned (seen in the tests of restarts).
  os::UniqueFd lock = os::LockWithin(path, 6 * os::kSpawnS);
  if (!lock.valid()) {
    throw std::runtime_error(path +
                             ": locked, expected no other grouser-jobs on this state folder");
  }
  return lock;
}

constexpr const char* kReadyHelp = "1: the job store can be read and the program does not stop.";
constexpr const char* kJobsHelp = "Jobs by state, ended ones too.";
constexpr const char* kEndedHelp = "Jobs that ended since the program started.";

v1alpha1::SubmitRefinementResponse AnswerOf(const v1alpha1::SubmitJobResponse& submitted) {
  v1alpha1::SubmitRefinementResponse response;
  *response.mutable_job() = submitted.job();
  response.set_joined(submitted.joined());
  return response;
}

[[noreturn]] void Precondition(const std::string& message) {
  throw StatusError(StatusCode::kFailedPrecondition, message);
}

/// A refit may have replaced the candidate since somebody looked at it.
void CheckIsWhatWasLookedAt(const v1alpha1::Job& job, const std::string& digest) {
  if (digest.empty() || job.candidate_digest().starts_with(digest)) return;
  Precondition(fmt::format(
      "candidate_digest: job '{}' has {} now, expected {}, which was looked at; nothing has moved",
      job.job_id(),
      job.candidate_digest().empty() ? "no candidate" : "the candidate " + job.candidate_digest(),
      digest));
}

}  // namespace

JobsApp::JobsApp(JobsOptions options, boost::asio::io_context& loop)
    : prune_(options.prune),
      prune_every_s_(options.prune_every_s),
      files_(options.state_dir),
      instance_lock_(LockState(files_.InstanceLock())),
      repository_(options.state_dir, options.shipped_dir),
      store_(files_.Database()),
      book_(store_, options.max_queued, UnixNow,
            [this](const v1alpha1::Job& job) {
              if (HasEnded(job.job_state())) ++ended_[job.job_state()];
              hub_.Publish(job);
            }),
      pruner_(files_, store_, book_, repository_),
      pool_(loop, options.grace_s),
      intake_({options.scheduler.bin_dir, options.scheduler.device, options.scheduler.work},
              options.scheduler.limits, files_, book_, pool_, thread_),
      scheduler_(std::make_unique<Scheduler>(options.scheduler, files_, book_, repository_, pool_,
                                             thread_)) {}

void JobsApp::Start() {
  std::promise<void> started;
  thread_.Post([&] {
    try {
      scheduler_->Recover();
      scheduler_->Kick();
      if (prune_.max_bytes > 0 || prune_.keep_s > 0) PruneEvery(prune_every_s_);
      started.set_value();
    } catch (...) {
      started.set_exception(std::current_exception());
    }
  });
  started.get_future().get();
}

void JobsApp::Stop(std::function<void()> done) {
  thread_.Post([this, done = std::move(done)] {
    if (std::exchange(stopping_, true)) return;
    intake_.Stop();
    scheduler_->Stop([this, done] {
      hub_.Stop();
      done();
    });
  });
}

void JobsApp::TellReadiness(std::function<void(std::vector<std::string>)> tell) {
  thread_.Post([this, tell = std::move(tell)] {
    std::vector<std::string> reasons;
    if (stopping_) reasons.push_back("the jobs program is stopping");
    try {
      store_.CountByState();
    } catch (const SqliteError& e) {
      reasons.push_back(std::string("job store: ") + e.what());
    }
    tell(std::move(reasons));
  });
}

void JobsApp::TellMetrics(std::function<void(MetricPage)> tell) {
  thread_.Post([this, tell = std::move(tell)] {
    MetricPage page;
    std::map<v1alpha1::JobState, std::size_t> jobs;
    try {
      jobs = store_.CountByState();
      page.AddGauge("grouser_ready", kReadyHelp, stopping_ ? 0 : 1);
    } catch (const SqliteError&) {
      page.AddGauge("grouser_ready", kReadyHelp, 0);
    }
    page.AddFamily("grouser_jobs", kJobsHelp, prometheus::MetricType::Gauge);
    for (int s = v1alpha1::JOB_STATE_UNSPECIFIED + 1; s < v1alpha1::JobState_ARRAYSIZE; ++s) {
      jobs.try_emplace(static_cast<v1alpha1::JobState>(s), 0);  // told from the start
    }
    for (const auto& [state, count] : jobs) {
      page.AddGauge("grouser_jobs", kJobsHelp, static_cast<double>(count),
                    {{"state", ShortName(state)}});
    }
    page.AddFamily("grouser_jobs_ended_total", kEndedHelp, prometheus::MetricType::Counter);
    for (const auto& [state, count] : jobs) {
      if (!HasEnded(state)) continue;
      page.AddCounter("grouser_jobs_ended_total", kEndedHelp, static_cast<double>(ended_[state]),
                      {{"state", ShortName(state)}});
    }
    page.AddGauge("grouser_job_requests_waiting", "Requests that wait for the thread of the jobs.",
                  thread_.waiting());
    tell(std::move(page));
  });
}

void JobsApp::RefuseWhenStopping() const {
  if (stopping_) throw StatusError(StatusCode::kUnavailable, "the jobs program is stopping");
}

v1alpha1::SubmitRefinementResponse JobsApp::Submit(const v1alpha1::SubmitRefinementRequest& request,
                                                   const std::string& who) {
  RefuseWhenStopping();
  CheckSubmit(request);
  // Before the model is looked up: it may have been replaced since.
  const std::string content = ContentOf(request);
  if (auto known = book_.Replay(request.request_id(), content)) {
    thread_.Post([this] { scheduler_->Kick(); });  // for one whose storing was in doubt
    return AnswerOf(*known);
  }
  Repository::Entry entry;
  try {
    entry = repository_.Resolve(request.model());
  } catch (const std::out_of_range& e) {
    throw StatusError(StatusCode::kNotFound, e.what());
  } catch (const std::runtime_error& e) {
    Precondition(e.what());  // the alias file is damaged; a digest needs none
  }
  const auto loaded = surrogate::ReadModel(entry.path);
  const auto spec = BuildSpec(loaded.model, request);
  CheckScene(loaded.model, spec);
  const auto submitted = book_.Submit(request.request_id(), content,
                                      RowOf(request, entry.name, entry.digest, spec), who);
  // Stable may have moved without this program: then a job that waits is fitted again.
  if (submitted.joined()) scheduler_->FollowStable(entry.name);
  // After the answer: starting work must not delay the acknowledgement.
  thread_.Post([this] { scheduler_->Kick(); });
  return AnswerOf(submitted);
}

void JobsApp::SubmitWork(WorkRequest request, const std::string& who, Intake::Done done) {
  RefuseWhenStopping();
  intake_.Submit(std::move(request), who,
                 [this, done = std::move(done)](std::exception_ptr problem, const auto& response) {
                   done(problem, response);
                   thread_.Post([this] { scheduler_->Kick(); });
                 });
}

v1alpha1::ReadJobFileResponse JobsApp::ReadFile(const v1alpha1::ReadJobFileRequest& request) {
  CheckJobId(request.job_id());
  return ReadResult(book_.Get(request.job_id()), files_, request);
}

v1alpha1::GetJobResponse JobsApp::Get(const v1alpha1::GetJobRequest& request) {
  CheckJobId(request.job_id());
  v1alpha1::GetJobResponse response;
  *response.mutable_job() = book_.Get(request.job_id());
  return response;
}

v1alpha1::CancelJobResponse JobsApp::Cancel(const v1alpha1::CancelJobRequest& request) {
  RefuseWhenStopping();
  CheckCancel(request);
  v1alpha1::CancelJobResponse response;
  *response.mutable_job() = book_.Cancel(request.job_id(), request.request_id());
  if (response.job().job_state() == v1alpha1::JOB_STATE_CANCELLED) {
    scheduler_->StopWorker(request.job_id());
  }
  return response;
}

void JobsApp::CheckPromotable(const v1alpha1::Job& job, const v1alpha1::PromoteRequest& request,
                              const std::string& alias) const {
  if (job.job_state() != v1alpha1::JOB_STATE_AWAITING_PROMOTION) {
    Precondition("job_id: job '" + job.job_id() + "' is " + ShortName(job.job_state()) +
                 ", expected AWAITING_PROMOTION");
  }
  if (request.override_gate()) return;
  if (!GatePassed(job)) Precondition(GateMessage(job) + "; override_gate promotes it all the same");
  // A canary is measured by what it is to replace.
  const std::string rival = alias == kCanaryAlias ? std::string(kDefaultAlias) : alias;
  const std::string target = repository_.ReadAliases().Find(ModelName(job), rival);
  // The candidate lacks what was promoted meanwhile, and the gate never
  // compared the two.
  if (!target.empty() && target != ModelDigest(job) && target != job.candidate_digest()) {
    Precondition("alias: " + rival + " has moved to " + target +
                 " since the candidate was fitted from " + ModelDigest(job) +
                 "; submit again, or promote with override_gate");
  }
}

v1alpha1::PromoteResponse JobsApp::Promote(const v1alpha1::PromoteRequest& request,
                                           const std::string& who) {
  RefuseWhenStopping();
  CheckPromote(request);
  const v1alpha1::Job job = book_.Get(request.job_id());
  CheckIsWhatWasLookedAt(job, request.candidate_digest());
  const std::string alias = request.alias().empty() ? std::string(kDefaultAlias) : request.alias();
  v1alpha1::PromoteResponse response;
  if (job.job_state() == v1alpha1::JOB_STATE_DONE && !job.candidate_digest().empty()) {
    // Asked again after a lost answer.
    const auto aliases = repository_.ReadAliases();
    if (aliases.Find(ModelName(job), alias) == job.candidate_digest()) {
      *response.mutable_job() = job;
      response.set_generation(aliases.generation);
      return response;
    }
  }
  FinishDecidedMoves(ModelName(job), job.job_id());
  CheckPromotable(job, request, alias);
  const auto decide = [&](const v1alpha1::PromoteRequest& move) {
    book_.Change(
        job.job_id(), job.lease_epoch(), [&](JobRow& row) { row.pending = move; },
        JobBook::Publish::kNo);
  };
  v1alpha1::PromoteRequest move = request;
  move.set_alias(alias);
  move.set_who(WhoOf(who, request.who()));
  if (move.why().empty()) move.set_why("refinement " + job.job_id());
  decide(move);
  try {
    response.set_generation(scheduler_->FinishPendingMove(job.job_id()));
  } catch (const SqliteError& e) {
    scheduler_->FinishMoveLater(job.job_id());
    throw StatusError(
        StatusCode::kUnavailable,
        std::string("the alias has moved, the job's row follows: job store: ") + e.what());
  } catch (const std::exception& e) {
    try {
      decide({});
    } catch (const SqliteError&) {  // it stays decided
      scheduler_->FinishMoveLater(job.job_id());
      throw StatusError(NotMovedCode(e),
                        std::string("alias not moved yet, which is tried again: ") + e.what());
    }
    throw StatusError(NotMovedCode(e), std::string("alias not moved: ") + e.what());
  }
  *response.mutable_job() = book_.Get(job.job_id());
  return response;
}

void JobsApp::FinishDecidedMoves(const std::string& model, const std::string& but) {
  for (const JobRow& row : book_.Open()) {
    if (ModelName(row.job) != model || row.job.job_id() == but) continue;
    if (row.pending.job_id().empty() || row.pending.alias() == kCandidateAlias) continue;
    try {
      scheduler_->FinishPendingMove(row.job.job_id());
    } catch (const SqliteError&) {
      throw;
    } catch (const std::runtime_error& e) {
      throw StatusError(NotMovedCode(e), "alias not moved: the promotion of " + row.job.job_id() +
                                             " comes before: " + e.what());
    }
  }
}

v1alpha1::MoveAliasResponse JobsApp::Move(const v1alpha1::MoveAliasRequest& request,
                                          const std::string& who) {
  RefuseWhenStopping();
  const std::string name = request.model().substr(0, request.model().find('@'));
  FinishDecidedMoves(name);
  const auto moved = MoveAlias(repository_, request, who);
  scheduler_->FollowStable(name);
  return moved;
}

v1alpha1::MoveAliasResponse JobsApp::Rollback(const v1alpha1::RollbackAliasRequest& request,
                                              const std::string& who) {
  RefuseWhenStopping();
  const std::string name = request.model().substr(0, request.model().find('@'));
  FinishDecidedMoves(name);
  const auto moved = RollbackAlias(repository_, request, who);
  scheduler_->FollowStable(name);
  return moved;
}

v1alpha1::ListAliasMovesResponse JobsApp::ListMoves(
    const v1alpha1::ListAliasMovesRequest& request) {
  return ListAliasMoves(repository_, request);
}

v1alpha1::PruneResponse JobsApp::Prune(const v1alpha1::PruneRequest& request) {
  RefuseWhenStopping();
  CheckPrune(request);
  PruneLimits limits = prune_;
  if (request.has_max_disk_mb()) limits.max_bytes = request.max_disk_mb() * kMegabyte;
  if (request.has_keep_days()) limits.keep_s = request.keep_days() * kDayS;
  return PruneTo(limits, request.dry_run());
}

v1alpha1::PruneResponse JobsApp::PruneTo(const PruneLimits& limits, bool dry_run) {
  try {
    if (!dry_run) EndWhatNobodyPromotes(limits.keep_s);
  } catch (const SqliteError& e) {  // as on a full disk: pruning gives space for it
    spdlog::error("jobs that nobody promotes go on: job store: {}", e.what());
  }
  try {
    return pruner_.Prune(limits, dry_run, UnixNow());
  } catch (const SqliteError&) {
    throw;
  } catch (const std::runtime_error& e) {
    Precondition(std::string("not pruned: ") + e.what());
  }
}

void JobsApp::EndWhatNobodyPromotes(double keep_s) {
  if (!(keep_s > 0)) return;
  for (const JobRow& row : book_.Open()) {
    const bool waits = row.job.job_state() == v1alpha1::JOB_STATE_AWAITING_PROMOTION &&
                       row.pending.job_id().empty();
    const double since = UnixNow() - static_cast<double>(row.job.update_time().seconds());
    if (!waits || since < keep_s) continue;
    book_.Change(row.job.job_id(), row.job.lease_epoch(), [&](JobRow& changed) {
      changed.job.set_job_state(v1alpha1::JOB_STATE_CANCELLED);
      changed.job.set_message(fmt::format("nobody promoted it for {:.4g} days", since / kDayS));
    });
  }
}

void JobsApp::PruneEvery(double seconds) {
  if (stopping_) return;
  try {
    PruneTo(prune_, /*dry_run=*/false);
  } catch (const std::exception& e) {
    spdlog::error("{}; next try in {} s", e.what(), seconds);
  }
  thread_.PostAfter(seconds, [this, seconds] { PruneEvery(seconds); });
}

void JobsApp::Watch(const v1alpha1::WatchJobRequest& request,
                    const std::shared_ptr<JobWatcher>& watcher) {
  RefuseWhenStopping();
  CheckJobId(request.job_id());
  const v1alpha1::Job job = book_.Get(request.job_id());
  watcher->OnJob(job);
  if (!HasEnded(job.job_state())) hub_.Add(job.job_id(), watcher);
}

}  // namespace grouser::server
