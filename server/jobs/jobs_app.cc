#include "server/jobs/jobs_app.h"

#include <chrono>
#include <future>
#include <stdexcept>
#include <utility>

#include "proto/records/os/file_lock.h"
#include "server/core/model_reference.h"
#include "server/core/status.h"
#include "server/jobs/job_state.h"
#include "server/jobs/refinement_spec.h"
#include "server/jobs/request_checks.h"
#include "server/jobs/scheduler_steps.h"
#include "surrogate/model_io/upgrade.h"

namespace grouser::server {
namespace {

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

[[noreturn]] void Precondition(const std::string& message) {
  throw StatusError(StatusCode::kFailedPrecondition, message);
}

}  // namespace

JobsApp::JobsApp(JobsOptions options, boost::asio::io_context& loop)
    : files_(options.state_dir),
      instance_lock_(LockState(files_.InstanceLock())),
      repository_(options.state_dir, options.shipped_dir),
      store_(files_.Database()),
      book_(store_, options.max_queued, UnixNow,
            [this](const v1alpha1::Job& job) { hub_.Publish(job); }),
      pool_(loop, options.grace_s),
      scheduler_(std::make_unique<Scheduler>(options.scheduler, files_, book_, repository_, pool_,
                                             thread_)) {}

void JobsApp::Start() {
  std::promise<void> started;
  thread_.Post([&] {
    try {
      scheduler_->Recover();
      scheduler_->Kick();
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
    scheduler_->Stop([this, done] {
      hub_.Stop();
      done();
    });
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
  if (auto known = book_.Replay(request)) return *known;
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
  auto response = book_.Submit(request, entry.name + "@sha256:" + entry.digest,
                               JoinKeyOf(entry.digest, spec), spec, who);
  // After the answer: starting work must not delay the acknowledgement.
  thread_.Post([this] { scheduler_->Kick(); });
  return response;
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
  const std::string target = repository_.ReadAliases().Find(ModelName(job), alias);
  // The candidate lacks what was promoted meanwhile, and the gate never
  // compared the two.
  if (!target.empty() && target != ModelDigest(job) && target != job.candidate_digest()) {
    Precondition("alias: " + alias + " has moved to " + target +
                 " since the candidate was fitted from " + ModelDigest(job) +
                 "; submit again, or promote with override_gate");
  }
}

v1alpha1::PromoteResponse JobsApp::Promote(const v1alpha1::PromoteRequest& request,
                                           const std::string& who) {
  RefuseWhenStopping();
  CheckPromote(request);
  const v1alpha1::Job job = book_.Get(request.job_id());
  const std::string alias = request.alias().empty() ? std::string(kDefaultAlias) : request.alias();
  v1alpha1::PromoteResponse response;
  if (job.job_state() == v1alpha1::JOB_STATE_DONE) {
    // Asked again after a lost answer.
    const auto aliases = repository_.ReadAliases();
    if (aliases.Find(ModelName(job), alias) == job.candidate_digest()) {
      *response.mutable_job() = job;
      response.set_generation(aliases.generation);
      return response;
    }
  }
  CheckPromotable(job, request, alias);
  const auto decide = [&](const v1alpha1::PromoteRequest& move) {
    book_.Change(
        job.job_id(), job.lease_epoch(), [&](JobRow& row) { row.pending = move; },
        JobBook::Publish::kNo);
  };
  v1alpha1::PromoteRequest move = request;
  move.set_alias(alias);
  move.set_who(request.who().empty() ? who : who + " (says: " + request.who() + ")");
  if (move.why().empty()) move.set_why("refinement " + job.job_id());
  decide(move);
  try {
    response.set_generation(scheduler_->FinishPendingMove(job.job_id()));
  } catch (const SqliteError&) {
    throw;  // the alias has moved; start-up, or asking again, brings the row along
  } catch (const std::exception& e) {
    decide({});
    throw StatusError(StatusCode::kUnavailable, std::string("alias not moved: ") + e.what());
  }
  *response.mutable_job() = book_.Get(job.job_id());
  return response;
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
