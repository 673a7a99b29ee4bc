#include "server/jobs/job_book.h"

#include <fmt/core.h>
#include <google/protobuf/util/time_util.h>
#include <spdlog/spdlog.h>
#include <sys/random.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <tuple>

#include "proto/records/model_file.h"
#include "server/core/page.h"
#include "server/core/status.h"
#include "server/jobs/job_state.h"
#include "server/jobs/request_checks.h"

namespace grouser::server {
namespace {

using google::protobuf::util::TimeUtil;

constexpr double kLongestEta = 1e9;  ///< [s]; of more nothing is known

/// Progress raises revisions in memory only. A requeue after a restart leaps
/// over all that may have been seen, so that revisions never go back.
constexpr std::uint64_t kRevisionLeap = 1'000'000;

[[noreturn]] void NoSuchJob(const std::string& job_id) {
  throw StatusError(StatusCode::kNotFound, "job_id: no job '" + job_id + "'");
}

}  // namespace

std::string NewJobId() {
  std::uint64_t bits = 0;
  if (getrandom(&bits, sizeof bits, 0) != static_cast<ssize_t>(sizeof bits)) {
    throw std::runtime_error("getrandom: no random bytes");
  }
  return fmt::format("job-{:016x}", bits);
}

JobBook::JobBook(JobStore& store, std::size_t max_queued, Clock clock, Listener listener)
    : store_(store),
      max_queued_(max_queued),
      clock_(std::move(clock)),
      listener_(std::move(listener)),
      open_(store.LoadOpen()) {}

JobRow* JobBook::Find(const std::string& job_id) {
  const auto found = std::find_if(open_.begin(), open_.end(),
                                  [&](const JobRow& row) { return row.job.job_id() == job_id; });
  return found == open_.end() ? nullptr : &*found;
}

std::optional<JobRow> JobBook::FindOpen(const std::string& job_id) const {
  const JobRow* row = const_cast<JobBook*>(this)->Find(job_id);
  return row == nullptr ? std::nullopt : std::optional(*row);
}

std::optional<JobRow> JobBook::NextQueued(const std::set<std::string>& but) const {
  std::map<std::string, int> working;
  for (const JobRow& row : open_) working[row.job.who()] += IsWorking(row.job.job_state());
  const auto place = [&](const JobRow& row) {
    const auto turn = turns_.find(row.job.who());
    return std::tuple(working[row.job.who()], turn == turns_.end() ? 0 : turn->second,
                      -row.job.priority());
  };
  const JobRow* next = nullptr;
  for (const JobRow& row : open_) {  // the oldest first: of equal ones that stays
    if (row.job.job_state() != v1alpha1::JOB_STATE_QUEUED) continue;
    if (but.contains(row.job.job_id())) continue;
    if (next == nullptr || place(row) < place(*next)) next = &row;
  }
  return next == nullptr ? std::nullopt : std::optional(*next);
}

void JobBook::CheckQueue(const std::string& client) const {
  std::size_t own = 0, all = 0;
  for (const JobRow& row : open_) {
    if (row.job.job_state() != v1alpha1::JOB_STATE_QUEUED) continue;
    if (!row.job.run_sha256().empty()) continue;  // it ran: nobody asked for it to wait again
    ++all;
    own += row.job.who() == client;
  }
  const auto refuse = [](const std::string& whose, std::size_t wait, std::size_t most) {
    throw StatusError(StatusCode::kResourceExhausted,
                      fmt::format("queue: {} jobs {}wait already, expected fewer than {}; "
                                  "submit again later",
                                  wait, whose, most));
  };
  if (own >= max_queued_) refuse("of this client ", own, max_queued_);
  if (own > 0 && all >= kMostClients * max_queued_) refuse("", all, kMostClients * max_queued_);
}

template <typename Write>
auto JobBook::Storing(const std::string& job_id, const Write& write) {
  try {
    return write();
  } catch (const SqliteError&) {
    // It may be stored all the same: where only the sync after it failed.
    try {
      auto stored = store_.Find(job_id);
      const JobRow* row = Find(job_id);
      if (stored && (row == nullptr || row->job.revision() < stored->job.revision())) {
        Adopt(std::move(*stored), Publish::kYes);
      }
    } catch (const std::exception& e) {
      spdlog::error("{}: cannot be read again: {}", job_id, e.what());
    }
    throw;
  }
}

void JobBook::Touch(JobRow& row) const {
  *row.job.mutable_update_time() = records::TimestampOf(clock_());
  row.job.set_revision(row.job.revision() + 1);
}

void JobBook::Adopt(JobRow row, Publish publish) {
  const v1alpha1::Job job = row.job;
  const auto place = std::find_if(open_.begin(), open_.end(), [&](const JobRow& other) {
    return other.job.job_id() == job.job_id();
  });
  if (HasEnded(job.job_state())) {
    if (place != open_.end()) open_.erase(place);
  } else if (place != open_.end()) {
    *place = std::move(row);
  } else {
    open_.push_back(std::move(row));
  }
  if (publish == Publish::kYes) listener_(job);
}

std::optional<v1alpha1::SubmitJobResponse> JobBook::Replay(const std::string& request_id,
                                                           const std::string& content) {
  const auto known = store_.FindRequest(request_id);
  if (!known) return std::nullopt;
  if (known->content != content) {
    throw StatusError(StatusCode::kAlreadyExists, "request_id: '" + request_id +
                                                      "' was used for a different request (job " +
                                                      known->job_id + ")");
  }
  v1alpha1::SubmitJobResponse response;
  *response.mutable_job() = Get(known->job_id);
  response.set_joined(known->joined);
  return response;
}

v1alpha1::SubmitJobResponse JobBook::Submit(const std::string& request_id,
                                            const std::string& content, JobRow fresh,
                                            const std::string& who) {
  if (auto known = Replay(request_id, content)) return *known;
  const auto same = std::find_if(open_.begin(), open_.end(),
                                 [&](const JobRow& row) { return row.join_key == fresh.join_key; });
  RequestRow asked{request_id, "", content, same != open_.end(), false};
  JobRow row;
  if (asked.joined) {
    row = *same;
    row.job.set_subscribers(row.job.subscribers() + 1);
    row.job.set_priority(std::max(row.job.priority(), fresh.job.priority()));
    Touch(row);
    asked.job_id = row.job.job_id();
    Storing(row.job.job_id(), [&] { store_.Join(row, asked); });
  } else {
    CheckQueue(who);
    row = std::move(fresh);
    if (row.job.job_id().empty()) row.job.set_job_id(NewJobId());
    row.job.set_job_state(v1alpha1::JOB_STATE_QUEUED);
    row.job.set_message("waiting for a worker");
    row.job.set_subscribers(1);
    row.job.set_who(who);
    row.job.set_lease_epoch(1);
    *row.job.mutable_submit_time() = records::TimestampOf(clock_());
    Touch(row);
    asked.job_id = row.job.job_id();
    Storing(row.job.job_id(), [&] { store_.Insert(row, asked); });
  }
  v1alpha1::SubmitJobResponse response;
  *response.mutable_job() = row.job;
  response.set_joined(asked.joined);
  Adopt(std::move(row), Publish::kYes);
  return response;
}

v1alpha1::Job JobBook::Get(const std::string& job_id) {
  if (const JobRow* row = Find(job_id)) return row->job;
  auto stored = store_.Find(job_id);
  if (!stored) NoSuchJob(job_id);
  return stored->job;
}

v1alpha1::ListJobsResponse JobBook::List(const v1alpha1::ListJobsRequest& request) {
  int size = 0;
  const Status read = ReadPageSize(request.page_size(), kMaxJobsPageSize, &size);
  if (!read.ok()) throw StatusError(read);
  auto jobs = store_.List(static_cast<std::size_t>(size), request.page_token());
  if (!jobs) throw StatusError(BadPageToken(request.page_token()));
  v1alpha1::ListJobsResponse response;
  std::size_t bytes = 0;
  bool whole = true;
  for (auto job = jobs->begin(); whole && job != jobs->end(); ++job) {
    if (const JobRow* row = Find(job->job_id())) *job = row->job;
    if (job->has_run()) {
      job->mutable_run()->clear_stress();
      job->mutable_run()->clear_surface();
    }
    whole = AddToPage(std::move(*job), &bytes, response.mutable_jobs());
  }
  if (!whole || static_cast<int>(jobs->size()) == size) {
    response.set_next_page_token(response.jobs(response.jobs_size() - 1).job_id());
  }
  return response;
}

v1alpha1::Job JobBook::Cancel(const std::string& job_id, const std::string& request_id) {
  const v1alpha1::Job now = Get(job_id);
  const auto request = store_.FindRequest(request_id);
  if (!request || request->job_id != job_id) {
    throw StatusError(StatusCode::kNotFound, "request_id: '" + request_id +
                                                 "' has no subscription to job '" + job_id + "'");
  }
  auto open = FindOpen(job_id);
  if (!open || request->withdrawn) return now;
  JobRow& row = *open;
  const std::uint64_t held = row.job.lease_epoch();
  row.job.set_subscribers(store_.CountSubscribers(job_id) - 1);
  if (row.job.subscribers() == 0) {
    row.job.set_job_state(v1alpha1::JOB_STATE_CANCELLED);
    row.job.set_message("cancelled: no subscriber is left");
    row.job.clear_eta();
    row.job.set_lease_epoch(held + 1);  // whatever a worker still reports is stale
  }
  Touch(row);
  if (!Storing(job_id, [&] { return store_.Withdraw(row, held, request_id); })) {
    throw StatusError(StatusCode::kInternal, "job_id: '" + job_id + "' has another lease epoch");
  }
  const v1alpha1::Job result = row.job;
  Adopt(std::move(row), Publish::kYes);
  return result;
}

std::optional<JobRow> JobBook::Change(const std::string& job_id, std::uint64_t epoch,
                                      const std::function<void(JobRow&)>& edit, Publish publish) {
  auto row = FindOpen(job_id);
  if (!row || row->job.lease_epoch() != epoch) return std::nullopt;
  const auto from = row->job.job_state();
  edit(*row);
  const auto to = row->job.job_state();
  if (from != to) {
    if (!MayMove(from, to)) {
      throw std::logic_error("job " + job_id + ": " + ShortName(from) + " to " + ShortName(to) +
                             " is no move of the state machine");
    }
    row->job.set_progress(0);
    row->job.clear_eta();
  }
  Touch(*row);
  if (!Storing(job_id, [&] { return store_.Save(*row, epoch); })) return std::nullopt;
  if (from != to && to == v1alpha1::JOB_STATE_RUNNING) turns_[row->job.who()] = ++turn_;
  Adopt(*row, publish);
  return row;
}

bool JobBook::Progress(const std::string& job_id, std::uint64_t epoch, double fraction,
                       double eta_s, const std::string& message) {
  JobRow* row = Find(job_id);
  if (row == nullptr || row->job.lease_epoch() != epoch || !IsWorking(row->job.job_state())) {
    return false;
  }
  row->job.set_progress(std::clamp(fraction, 0.0, 1.0));
  if (std::isfinite(eta_s) && eta_s >= 0 && eta_s < kLongestEta) {
    *row->job.mutable_eta() = TimeUtil::MillisecondsToDuration(std::llround(1e3 * eta_s));
  } else {
    row->job.clear_eta();
  }
  row->job.set_message(message);
  Touch(*row);
  listener_(row->job);
  return true;
}

bool JobBook::Requeue(const std::string& job_id, std::uint64_t epoch, const std::string& message,
                      Retries retries) {
  const auto queued = Change(job_id, epoch, [&](JobRow& row) {
    row.job.set_job_state(v1alpha1::JOB_STATE_QUEUED);
    row.job.set_message(message);
    row.job.clear_gate();
    row.job.clear_candidate_digest();
    row.job.set_lease_epoch(epoch + 1);
    row.job.set_revision(row.job.revision() + kRevisionLeap);
    if (retries == Retries::kOneMore) ++row.retries;
    if (retries == Retries::kNone) row.retries = 0;
  });
  return queued.has_value();
}

}  // namespace grouser::server
