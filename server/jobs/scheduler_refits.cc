// Scheduler: candidates follow stable, and have each other's runs.
#include <fmt/core.h>
#include <fmt/ranges.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <filesystem>
#include <stdexcept>

#include "server/core/model_reference.h"
#include "server/jobs/refit_plan.h"
#include "server/jobs/scheduler.h"

namespace grouser::server {

std::optional<JobRow> Scheduler::OnPresentBase(const JobRow& row) {
  const std::string& id = row.job.job_id();
  std::optional<JobRow> now = row;
  try {
    const std::string base = BaseNow(repository_, models_, row);
    if (base != ModelDigest(row.job)) {
      spdlog::info("{}: is fitted from {}, which is stable now", id, base);
      now = book_.Change(id, row.job.lease_epoch(), [&](JobRow& changed) {
        changed.job.set_model(ReferenceOf(ModelName(row.job), base));
      });
      std::error_code ignored;  // of the base before
      std::filesystem::remove(files_.Candidate(id), ignored);
      std::filesystem::remove(files_.Alone(id), ignored);
    }
  } catch (const SqliteError&) {
    throw;
  } catch (const std::exception& e) {  // the run is there, and so is the base that was named
    spdlog::error("{}: {}; it is fitted from {}", id, e.what(), row.job.model());
  }
  if (!now) return std::nullopt;
  if (!FollowsStable(*now)) return now;
  const std::string base = ModelDigest(now->job);
  if (!HasRun(models_.Of(ModelName(now->job), base), now->job.run_sha256())) return now;
  EndAsContained(*now, base);
  return std::nullopt;
}

void Scheduler::EndAsContained(const JobRow& row, const std::string& digest) {
  book_.Change(row.job.job_id(), row.job.lease_epoch(), [&](JobRow& changed) {
    changed.job.clear_gate();  // of what it had for itself
    changed.job.set_candidate_digest(digest);
    changed.job.set_job_state(v1alpha1::JOB_STATE_DONE);
    changed.job.set_message(ReferenceOf(ModelName(row.job), digest) + " is fitted to its run");
  });
}

Companions Scheduler::CompanionsFor(const JobRow& row, const std::set<std::string>& left_out) {
  if (std::filesystem::exists(files_.Alone(row.job.job_id()))) return {};
  return CompanionsOf(repository_, models_, book_.Open(), row, left_out);
}

void Scheduler::FitAlone(const JobRow& row, const std::string& why) {
  const std::string& id = row.job.job_id();
  spdlog::warn("{}: {}; it is fitted without them", id, why);
  records::WriteFileDurably(files_.Alone(id), why + "\n");
  std::error_code ignored;  // a start after a kill must not take it over
  std::filesystem::remove(files_.Candidate(id), ignored);
  book_.Requeue(id, row.job.lease_epoch(), "fitted alone: " + why, Retries::kNone);
}

bool Scheduler::FitAgain(const JobRow& row, bool with_others) {
  const std::string& id = row.job.job_id();
  const auto again = [&](const std::string& why) {
    spdlog::info("{}: is fitted again: {}", id, why);
    return book_.Requeue(id, row.job.lease_epoch(), "fitted again: " + why, Retries::kNone);
  };
  try {
    const std::string base = BaseNow(repository_, models_, row);
    if (base != ModelDigest(row.job)) return again("stable is now " + base);
    if (!with_others) return false;
    const Companions with = CompanionsFor(row, passed_over_[id]);
    const auto lacking = Lacking(files_.Candidate(id), with.run_ids);
    return !lacking.empty() && again("with the runs of other candidates");
  } catch (const SqliteError&) {
    throw;
  } catch (const std::exception& e) {
    spdlog::error("{}: {}; its candidate stays as it is", id, e.what());
    return false;
  }
}

void Scheduler::FollowStable(const std::string& model) {
  thread_.Post([this, model] { FollowStableNow(model, 0); });
}

void Scheduler::FollowStableNow(const std::string& model, double retry_s) {
  if (stopping_) return;
  try {
    const std::string stable = repository_.ReadAliases().Find(model, std::string(kDefaultAlias));
    for (const JobRow& row : book_.Open()) {
      const bool waits = row.job.job_state() == v1alpha1::JOB_STATE_AWAITING_PROMOTION &&
                         row.pending.job_id().empty();
      if (!waits || ModelName(row.job) != model || ModelDigest(row.job) == stable) continue;
      const std::string base = BaseNow(repository_, models_, row);
      if (base == ModelDigest(row.job)) continue;
      if (HasRun(models_.Of(model, base), row.job.run_sha256())) {
        EndAsContained(row, base);
      } else {
        FitAgain(row, /*with_others=*/false);
      }
    }
    Kick();
  } catch (const std::exception& e) {
    const double then_s = std::min(std::max(2 * retry_s, options_.retry_s), kLongestRetryS);
    const bool first = following_.insert(model).second;
    spdlog::error("{}: its candidates do not follow stable yet: {}; {}", model, e.what(),
                  first ? fmt::format("next try in {} s", then_s) : "is tried again already");
    if (!first) return;
    thread_.PostAfter(then_s, [this, model, then_s] {
      following_.erase(model);
      FollowStableNow(model, then_s);
    });
  }
}

void Scheduler::ConcludeFit(const JobRow& row, const Ended& ended) {
  const std::string candidate = files_.Candidate(ended.job_id);
  CheckCandidate(candidate, row.job);
  if (const auto lacking = Lacking(candidate, ended.run_ids); !lacking.empty()) {
    throw std::runtime_error(
        fmt::format("{}: its provenance does not name the runs {} of other candidates", candidate,
                    fmt::join(lacking, ", ")));
  }
  if (!FitAgain(row, /*with_others=*/true)) AcceptCandidate(row, "checking the candidate");
}

}  // namespace grouser::server
