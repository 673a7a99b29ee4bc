#include "server/jobs/scheduler.h"

#include <fmt/core.h>
#include <fmt/ranges.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <limits>
#include <stdexcept>

#include "proto/records/durable_file.h"
#include "proto/records/message_json.h"
#include "proto/records/model_file.h"
#include "proto/records/os/file_lock.h"
#include "proto/records/os/no_space.h"
#include "server/core/model_reference.h"
#include "server/jobs/job_state.h"
#include "server/jobs/refit_plan.h"
#include "server/jobs/scheduler_steps.h"
#include "server/jobs/work_request.h"

namespace grouser::server {
namespace {

constexpr double kEvictS = 10.0;
constexpr double kDiskEveryS = 5.0;
constexpr double kMegabytes = 1e6;

double SteadyNow() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// The smaller of the job's own limit and the program's [s]; 0: none.
double LimitOf(const v1alpha1::Job& job, double program_s) {
  if (!job.has_time_limit()) return program_s;
  const double own_s =
      static_cast<double>(job.time_limit().seconds()) + 1e-9 * job.time_limit().nanos();
  return program_s > 0 ? std::min(own_s, program_s) : own_s;
}

}  // namespace

Scheduler::Scheduler(SchedulerOptions options, const JobFiles& files, JobBook& book,
                     Repository& repository, WorkerPool& pool, SerialThread& thread)
    : options_(std::move(options)),
      files_(files),
      book_(book),
      repository_(repository),
      pool_(pool),
      thread_(thread) {}

void Scheduler::Recover() {
  std::set<std::string> models;
  for (const JobRow& row : book_.Open()) {
    Guarded(row.job.job_id(), row.job.lease_epoch(), [this, row] { RecoverJob(row); });
    if (!HasWork(row.job)) models.insert(ModelName(row.job));
  }
  for (const std::string& model : models) FollowStable(model);
}

void Scheduler::RecoverJob(const JobRow& row) {
  const std::string& id = row.job.job_id();
  if (IsWorking(row.job.job_state())) {
    if (std::filesystem::exists(files_.Lock(id))) os::LockEvicting(files_.Lock(id), kEvictS);
    spdlog::info("{}: was {} when the jobs program ended; queued again", id,
                 ShortName(row.job.job_state()));
    book_.Requeue(id, row.job.lease_epoch(), "queued again after a restart", Retries::kKeep);
  }
  if (!row.pending.job_id().empty()) RetryPendingMove(id, options_.retry_s);
}

void Scheduler::Kick() {
  while (!stopping_ && static_cast<int>(active_.size() + waiting_.size()) < options_.workers) {
    const auto next = book_.NextQueued(waiting_);  // those have a timer of their own
    if (!next) return;
    const std::string& id = next->job.job_id();
    const std::uint64_t epoch = next->job.lease_epoch();
    Guarded(id, epoch, [this, id] { Continue(id); });
    const auto same = book_.NextQueued(waiting_);
    if (same && same->job.job_id() == id && same->job.lease_epoch() == epoch) return;
  }
}

void Scheduler::Continue(const std::string& job_id) {
  auto open = book_.FindOpen(job_id);
  if (stopping_ || !open || active_.contains(job_id)) return;
  if (open->job.job_state() == v1alpha1::JOB_STATE_QUEUED) {
    open = book_.Change(job_id, open->job.lease_epoch(), [](JobRow& row) {
      row.job.set_job_state(v1alpha1::JOB_STATE_RUNNING);
      row.job.set_message("starting");
    });
    if (!open) return;
    records::MakeFolderDurably(files_.Folder(job_id));
  }
  const JobRow& row = *open;
  if (row.job.job_state() == v1alpha1::JOB_STATE_FITTING) LaunchFit(row);
  if (row.job.job_state() == v1alpha1::JOB_STATE_VALIDATING) LaunchGate(row);
  if (row.job.job_state() != v1alpha1::JOB_STATE_RUNNING) return;
  if (HasWork(row.job)) {
    LaunchWork(row);
  } else if (const auto run = AdoptableRun(files_, row)) {
    spdlog::info("{}: takes over the finished run {}", job_id, run->file);
    AcceptRun(row, *run);
  } else {
    LaunchRun(row);
  }
}

void Scheduler::Launch(const JobRow& row, std::vector<std::string> argv, double timeout_s) {
  const v1alpha1::Job& job = row.job;
  const std::string stage = NamesOf(job).file;
  WorkerCommand command;
  command.argv = std::move(argv);
  command.folder = files_.Folder(job.job_id());
  command.stdout_path = files_.Output(job, stage, "stdout");
  command.log_path = files_.Output(job, stage, "log");
  command.lock = os::LockEvicting(files_.Lock(job.job_id()), kEvictS);
  command.limits = options_.limits;
  command.timeout_s = timeout_s;
  const std::string id = job.job_id();
  const std::uint64_t epoch = job.lease_epoch();
  const v1alpha1::JobState state = job.job_state();
  active_[id] = {epoch, SteadyNow(), ""};
  spdlog::info("{}: {} (epoch {}): {}", id, stage, epoch, fmt::join(command.argv, " "));
  pool_.Start(id, std::move(command),
              {[this, id, epoch](const ProgressLine& line) {
                 thread_.Post([this, id, epoch, line] { OnProgress(id, epoch, line); });
               },
               [this, id, epoch, state](const WorkerEnd& end) {
                 thread_.Post([this, ended = Ended{id, epoch, state, end, ""}] { OnEnd(ended); });
               }});
}

void Scheduler::LaunchRun(const JobRow& row) {
  const std::string& id = row.job.job_id();
  records::WriteFileDurably(files_.Spec(id), records::ToJson(row.spec, /*indented=*/true));
  Launch(row,
         {options_.bin_dir + "/grouser-dem", "run", "--spec", files_.Spec(id), "--out",
          files_.WorkerRun(id), "--known", files_.Run(""), "--tiles", files_.Tiles(),
          "--progress-lines", "--json", "--device", options_.device},
         LimitOf(row.job, options_.dem_timeout_s));
}

void Scheduler::LaunchFit(const JobRow& before) {
  const std::string id = before.job.job_id();
  const auto row = OnPresentBase(before);
  if (!row) return;
  const Companions with = CompanionsFor(*row, {});
  std::erase_if(passed_over_, [&](const auto& of) { return !book_.FindOpen(of.first); });
  passed_over_[id] = with.passed_over;
  if (CandidateIsThere(files_, *row) && Lacking(files_.Candidate(id), with.run_ids).empty()) {
    spdlog::info("{}: takes over the finished candidate", id);
    AcceptCandidate(*row, "checking the candidate that was fitted before");
    return;
  }
  std::vector<std::string> argv = {options_.bin_dir + "/grouser-fit",
                                   "refit",
                                   "--base",
                                   repository_.Resolve(row->job.model()).path,
                                   "--run",
                                   files_.Run(row->job.run_file()),
                                   "--out",
                                   files_.Candidate(id),
                                   "--reason",
                                   "refinement " + id};
  for (const std::string& model : with.models) argv.insert(argv.end(), {"--with", model});
  Launch(*row, std::move(argv), options_.fit_timeout_s);
  active_[id].run_ids = with.run_ids;
}

void Scheduler::LaunchGate(const JobRow& row) {
  std::vector<std::string> argv = {options_.bin_dir + "/grouser-fit",
                                   "gate",
                                   "--base",
                                   repository_.Resolve(row.job.model()).path,
                                   "--candidate",
                                   files_.Candidate(row.job.job_id()),
                                   "--json"};
  for (const surrogate::GateLimitField& field : surrogate::kGateLimits) {
    argv.insert(argv.end(),
                {std::string("--") + field.option, fmt::format("{}", options_.gate.*field.value)});
  }
  Launch(row, std::move(argv), options_.fit_timeout_s);
}

void Scheduler::LaunchWork(const JobRow& row) {
  records::MakeFolderDurably(files_.Folder(row.job.job_id()) + "/" + kOutFolder);
  Launch(row, CommandOf(row.job, Programs()), LimitOf(row.job, options_.work.timeout_s));
  if (options_.work.max_job_bytes > 0) WatchDisk(row.job.job_id(), row.job.lease_epoch());
}

void Scheduler::WatchDisk(const std::string& job_id, std::uint64_t epoch) {
  const auto active = active_.find(job_id);
  if (active == active_.end() || active->second.epoch != epoch) return;
  const std::uint64_t bytes = BytesBelow(files_.Folder(job_id));
  if (bytes > options_.work.max_job_bytes) {
    active->second.stop_reason =
        fmt::format("was stopped: its folder takes {:.1f} MB, allowed are {:.1f}",
                    bytes / kMegabytes, options_.work.max_job_bytes / kMegabytes);
    pool_.Terminate(job_id);
    return;
  }
  thread_.PostAfter(kDiskEveryS, [this, job_id, epoch] { WatchDisk(job_id, epoch); });
}

void Scheduler::OnProgress(const std::string& job_id, std::uint64_t epoch,
                           const ProgressLine& line) {
  const auto active = active_.find(job_id);
  if (active == active_.end() || active->second.epoch != epoch) return;
  const double elapsed = SteadyNow() - active->second.started_s;
  const double eta = line.fraction > 0.01 ? elapsed * (1 - line.fraction) / line.fraction
                                          : std::numeric_limits<double>::quiet_NaN();
  book_.Progress(job_id, epoch, line.fraction, line.eta_s.value_or(eta), line.stage);
}

void Scheduler::OnEnd(Ended ended) {
  const auto active = active_.find(ended.job_id);
  if (active != active_.end()) {
    ended.stop_reason = std::move(active->second.stop_reason);
    ended.run_ids = std::move(active->second.run_ids);
    active_.erase(active);
  }
  if (!stopping_) {
    Guarded(ended.job_id, ended.epoch, [this, ended] { Conclude(ended); });
    Kick();
  } else if (active_.empty() && stopped_) {
    stopped_();
  }
}

void Scheduler::Conclude(const Ended& ended) {
  const auto& [id, epoch, stage, end, stop_reason, run_ids] = ended;
  const auto open = book_.FindOpen(id);
  if (!open || open->job.lease_epoch() != epoch) {
    spdlog::info("{}: a worker of epoch {} {}; its lease is over, nothing is taken from it", id,
                 epoch, end.Text());
    return;
  }
  const JobRow& row = *open;
  if (row.job.job_state() != stage) {
    Continue(id);  // concluded before, but what came next could not be stored then
    return;
  }
  const bool gate = stage == v1alpha1::JOB_STATE_VALIDATING;
  if (!end.Exited(0) && !(gate && end.Exited(3))) {
    const StageNames names = NamesOf(row.job);
    if (!stop_reason.empty()) {
      EndAbnormally(id, epoch, names.program + " " + stop_reason, Retry::kNo);
      return;
    }
    const std::string words = LastWords(files_.Output(row.job, names.file, "log"));
    if (!run_ids.empty()) {
      FitAlone(row, names.program + " " + end.Text() + " with the runs of other candidates" +
                        (words.empty() ? "" : ": " + words));
      return;
    }
    // Bad input (2) stays bad, and what is slow stays slow; what was killed or found no room may
    // fare better.
    EndAbnormally(id, epoch, names.program + " " + end.Text() + (words.empty() ? "" : ": " + words),
                  end.Exited(2) || end.timed_out ? Retry::kNo : Retry::kOnce);
  } else if (HasWork(row.job)) {
    AcceptWork(row);
  } else if (stage == v1alpha1::JOB_STATE_RUNNING) {
    AcceptRun(row, PublishRun(files_, row));
  } else if (stage == v1alpha1::JOB_STATE_FITTING) {
    ConcludeFit(row, ended);
  } else {
    ConcludeGate(row);
  }
}

void Scheduler::AcceptRun(const JobRow& row, const FinishedRun& run) {
  const std::string& id = row.job.job_id();
  const bool steady = run.record.status() == v1alpha1::RUN_STATUS_STEADY;
  const auto accepted = book_.Change(id, row.job.lease_epoch(), [&](JobRow& changed) {
    changed.job.set_run_file(run.file);
    changed.job.set_run_sha256(run.sha256);
    *changed.job.mutable_run() = run.record;
    changed.job.set_job_state(steady ? v1alpha1::JOB_STATE_FITTING : v1alpha1::JOB_STATE_FAILED);
    changed.job.set_message(steady ? "fitting with the new run" : WhyNotSteady(run.record));
  });
  if (!accepted) return;  // its lease was taken away meanwhile
  // The published file and the row stand: the worker's own copy has served.
  std::error_code ignored;
  std::filesystem::remove(files_.WorkerRun(id), ignored);
  if (steady) LaunchFit(*accepted);
}

void Scheduler::AcceptWork(const JobRow& row) {
  const std::string& id = row.job.job_id();
  const auto results = ResultsOf(row.job, files_);
  if (results.empty()) throw std::runtime_error(ProgramOf(row.job) + " has left no result");
  const auto accepted = book_.Change(id, row.job.lease_epoch(), [&](JobRow& changed) {
    changed.job.mutable_results()->Assign(results.begin(), results.end());
    changed.job.set_job_state(v1alpha1::JOB_STATE_DONE);
    changed.job.set_message(fmt::format("{} files to fetch", results.size()));
  });
  if (!accepted) return;
  std::error_code ignored;  // beds that nothing will need again
  std::filesystem::remove_all(files_.Result(id, "tiles"), ignored);
}

void Scheduler::AcceptCandidate(const JobRow& row, const std::string& message) {
  const auto accepted = book_.Change(row.job.job_id(), row.job.lease_epoch(), [&](JobRow& changed) {
    changed.job.set_job_state(v1alpha1::JOB_STATE_VALIDATING);
    changed.job.set_message(message);
  });
  if (accepted) LaunchGate(*accepted);
}

void Scheduler::ConcludeGate(const JobRow& row) {
  const std::string& id = row.job.job_id();
  v1alpha1::Job judged = row.job;
  ParseGate(records::ReadFileBytes(files_.Output(row.job, "gate", "stdout")), &judged);
  CheckCandidate(files_.Candidate(id), row.job);
  if (FitAgain(row, /*with_others=*/GatePassed(judged))) return;
  if (!GatePassed(judged) && !std::filesystem::exists(files_.Alone(id)) &&
      HasRunsOfOthers(models_, files_.Candidate(id), row)) {
    FitAlone(row, "with the runs of others: " + GateMessage(judged));
    return;
  }
  const std::string digest = repository_.Publish(files_.Candidate(id));
  // Watchers hear of it when the alias points there too.
  book_.Change(
      id, row.job.lease_epoch(),
      [&](JobRow& changed) {
        *changed.job.mutable_gate() = judged.gate();
        changed.job.set_candidate_digest(digest);
        changed.job.set_job_state(v1alpha1::JOB_STATE_AWAITING_PROMOTION);
        changed.job.set_message(GateMessage(judged));
        changed.pending.set_job_id(id);
        changed.pending.set_alias(std::string(kCandidateAlias));
        changed.pending.set_who("grouser-jobs");
        changed.pending.set_why("refinement " + id);
      },
      JobBook::Publish::kNo);
  RetryPendingMove(id, options_.retry_s);
}

std::uint64_t Scheduler::FinishPendingMove(const std::string& job_id) {
  const auto row = book_.FindOpen(job_id);
  if (!row) throw std::logic_error(job_id + ": has ended, expected a job that awaits promotion");
  const auto& move = row->pending;
  const AliasMove moved = repository_.SetAlias(ModelName(row->job), move.alias(),
                                               row->job.candidate_digest(), move.who(), move.why());
  const bool offered = move.alias() == kCandidateAlias;
  const v1alpha1::PromoteRequest next = offered ? NextMove(row->job) : v1alpha1::PromoteRequest();
  book_.Change(job_id, row->job.lease_epoch(), [&](JobRow& changed) {
    if (!offered) {
      changed.job.set_job_state(v1alpha1::JOB_STATE_DONE);
      changed.job.set_message(fmt::format("promoted to {} by {}", move.alias(), move.who()));
    }
    changed.pending = next;
  });
  FollowStable(ModelName(row->job));
  return moved.generation;
}

v1alpha1::PromoteRequest Scheduler::NextMove(const v1alpha1::Job& job) const {
  v1alpha1::PromoteRequest move;
  if (options_.auto_promote.empty() || !GatePassed(job)) return move;
  // What became stable meanwhile, the gate has not seen.
  const std::string stable =
      repository_.ReadAliases().Find(ModelName(job), std::string(kDefaultAlias));
  if (stable != ModelDigest(job)) {
    spdlog::info("{}: passes the gate, but stable is now {}: a person decides", job.job_id(),
                 stable);
    return move;
  }
  move.set_job_id(job.job_id());
  move.set_alias(options_.auto_promote);
  move.set_who("grouser-jobs");
  move.set_why("refinement " + job.job_id() + " passes the gate");
  return move;
}

void Scheduler::RetryPendingMove(const std::string& job_id, double retry_s) {
  const auto row = book_.FindOpen(job_id);
  if (!row || row->pending.job_id().empty()) return;
  try {
    FinishPendingMove(job_id);
    if (row->pending.alias() == kCandidateAlias) RetryPendingMove(job_id, retry_s);
  } catch (const std::exception& e) {
    spdlog::error("{}: alias not moved yet: {}; next try in {} s", job_id, e.what(), retry_s);
    // An alias file that stays damaged must not fill the log.
    const double then_s = std::min(2 * retry_s, kLongestRetryS);
    thread_.PostAfter(retry_s, [this, job_id, then_s] { RetryPendingMove(job_id, then_s); });
  }
}

void Scheduler::FinishMoveLater(const std::string& job_id) {
  thread_.PostAfter(options_.retry_s,
                    [this, job_id] { RetryPendingMove(job_id, options_.retry_s); });
}

void Scheduler::EndAbnormally(const std::string& job_id, std::uint64_t epoch,
                              const std::string& why, Retry retry) {
  const auto row = book_.FindOpen(job_id);
  if (!row || row->job.lease_epoch() != epoch) return;
  spdlog::warn("{}: {}", job_id, why);
  if (retry == Retry::kOnce && row->retries < 1 && IsWorking(row->job.job_state())) {
    book_.Requeue(job_id, epoch, "trying once more: " + why, Retries::kOneMore);
    return;
  }
  const auto results =
      HasWork(row->job) ? ResultsOf(row->job, files_) : std::vector<v1alpha1::JobResult>();
  book_.Change(job_id, epoch, [&](JobRow& changed) {
    changed.job.mutable_results()->Assign(results.begin(), results.end());
    changed.job.set_job_state(v1alpha1::JOB_STATE_FAILED);
    changed.job.set_message(why);
  });
}

void Scheduler::Guarded(const std::string& job_id, std::uint64_t epoch,
                        std::function<void()> step) {
  try {
    try {
      step();
    } catch (const SqliteError&) {
      throw;
    } catch (const os::NoSpace& e) {
      TryLater(job_id, epoch, std::move(step), e.what());
    } catch (const std::exception& e) {
      EndAbnormally(job_id, epoch, e.what(), Retry::kOnce);
    }
  } catch (const SqliteError& e) {
    TryLater(job_id, epoch, std::move(step), std::string("job store: ") + e.what());
  }
}

void Scheduler::TryLater(const std::string& job_id, std::uint64_t epoch, std::function<void()> step,
                         const std::string& why) {
  spdlog::error("{}: {}; next try in {} s", job_id, why, options_.retry_s);
  waiting_.insert(job_id);
  thread_.PostAfter(options_.retry_s, [this, job_id, epoch, step = std::move(step)] {
    waiting_.erase(job_id);
    if (stopping_ || active_.contains(job_id)) return;
    Guarded(job_id, epoch, step);
    Kick();
  });
}

void Scheduler::StopWorker(const std::string& job_id) {
  if (active_.contains(job_id)) pool_.Terminate(job_id);
}

void Scheduler::Stop(std::function<void()> done) {
  stopping_ = true;
  stopped_ = std::move(done);
  for (const JobRow& row : book_.Open()) {
    if (!IsWorking(row.job.job_state())) continue;
    try {
      book_.Requeue(row.job.job_id(), row.job.lease_epoch(),
                    "interrupted by a stop of the jobs program; goes on when it starts again",
                    Retries::kKeep);
    } catch (const std::exception& e) {
      spdlog::error("{}: {}; start-up will queue it again", row.job.job_id(), e.what());
    }
  }
  for (const auto& [job_id, active] : active_) pool_.Terminate(job_id);
  if (active_.empty()) stopped_();
}

}  // namespace grouser::server
