#include "server/jobs/refit_plan.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <ranges>
#include <stdexcept>
#include <utility>

#include "server/core/model_reference.h"
#include "server/jobs/job_files.h"
#include "server/jobs/refinement_spec.h"
#include "server/jobs/scheduler_steps.h"
#include "surrogate/model_io/run_summary.h"
#include "surrogate/model_io/upgrade.h"

namespace grouser::server {
namespace {

std::set<std::string> RunIdsOf(const v1alpha1::Model& model) {
  std::set<std::string> ids;
  for (const auto& run : model.provenance().runs()) ids.insert(run.run_id());
  return ids;
}

using Entries = std::map<std::string, Repository::Entry>;

/// The models of a name that can be read, by digest.
Entries ReadableModels(const Repository& repository, const std::string& name) {
  Entries entries;
  for (Repository::Entry& entry : repository.List(nullptr)) {
    if (entry.name == name) entries.emplace(entry.digest, std::move(entry));
  }
  return entries;
}

/// Candidates that may have runs for the job's, the first to be looked at first.
std::vector<std::string> CandidatesOf(const Repository& repository, const std::vector<JobRow>& open,
                                      const JobRow& row) {
  std::vector<std::string> digests;
  std::set<std::string> seen;
  const auto add = [&](const std::string& digest) {
    if (seen.insert(digest).second) digests.push_back(digest);
  };
  try {
    const std::string canary =
        repository.ReadAliases().Find(ModelName(row.job), std::string(kCanaryAlias));
    if (!canary.empty() && canary != ModelDigest(row.job)) add(canary);
  } catch (const std::exception& e) {
    spdlog::warn("{}: {}: the runs of canary are left out", row.job.job_id(), e.what());
  }
  for (const JobRow& other : open | std::views::reverse) {
    if (other.job.job_id() == row.job.job_id() || other.job.model() != row.job.model()) continue;
    if (FollowsStable(other) && GatePassed(other.job)) add(other.job.candidate_digest());
  }
  return digests;
}

/// Training runs of a model that are in none of these.
std::set<std::string> FurtherRuns(const v1alpha1::Model& model, const std::set<std::string>& known,
                                  const std::set<std::string>& found) {
  std::set<std::string> more;
  for (const auto& run : model.provenance().runs()) {
    if (surrogate::RoleOf(run) != v1alpha1::RUN_ROLE_TRAIN) continue;
    if (!known.contains(run.run_id()) && !found.contains(run.run_id())) more.insert(run.run_id());
  }
  return more;
}

/// Whether a model is `from` or was refitted from it, by steps that are known or still there.
bool ComesFrom(KnownModels& models, const Entries& there, const std::string& name,
               std::string digest, const std::string& from) {
  if (from.empty()) return false;
  for (int step = 0; step <= kMostAncestors; ++step) {
    if (digest == from) return true;
    const bool pruned = !models.Has(digest) && !there.contains(digest);
    if (digest.empty() || pruned) return false;
    digest = models.Of(name, digest).provenance().base_digest();
  }
  return false;
}

}  // namespace

bool FollowsStable(const JobRow& row) {
  return row.join_key.starts_with(StableKeyOf(ModelName(row.job)));
}

std::string BaseNow(const Repository& repository, KnownModels& models, const JobRow& row) {
  const std::string own = ModelDigest(row.job), name = ModelName(row.job);
  if (!FollowsStable(row)) return own;
  const std::string stable = repository.ReadAliases().Find(name, std::string(kDefaultAlias));
  if (stable.empty() || stable == own) return own;
  return IsOfScene(models.Of(name, stable), row.spec) ? stable : own;
}

bool HasRun(const v1alpha1::Model& model, const std::string& sha256) {
  return std::ranges::any_of(model.provenance().runs(), [&](const v1alpha1::RunSummary& run) {
    return run.sha256() == sha256;
  });
}

Companions CompanionsOf(const Repository& repository, KnownModels& models,
                        const std::vector<JobRow>& open, const JobRow& row,
                        const std::set<std::string>& left_out) {
  Companions found;
  if (!FollowsStable(row)) return found;
  const std::string name = ModelName(row.job), base = ModelDigest(row.job);
  const std::vector<std::string> digests = CandidatesOf(repository, open, row);
  std::set<std::string> named(digests.begin(), digests.end());
  for (const JobRow& one : open) named.insert({ModelDigest(one.job), one.job.candidate_digest()});
  models.KeepOnly(named);  // ended jobs' candidates must not add up
  if (digests.empty()) return found;
  const std::set<std::string> known = RunIdsOf(models.Of(name, base));
  const Entries there = ReadableModels(repository, name);
  std::size_t read = 0;
  for (const std::string& digest : digests) {
    const auto entry = there.find(digest);
    if (entry == there.end()) {  // it must not take the place of one that is
      if (models.TellOnce(digest)) {
        spdlog::warn("{}: model {} is not there or damaged: its runs are left out",
                     row.job.job_id(), digest);
      }
      continue;
    }
    models.Found(digest);
    const bool further = !models.Has(digest);
    if (left_out.contains(digest) || found.models.size() == kMostCombined ||
        (further && read == kMostCombined)) {
      found.passed_over.insert(digest);
      continue;
    }
    read += further;
    try {
      const v1alpha1::Model& model = models.Of(entry->second);
      std::set<std::string> more = FurtherRuns(model, known, found.run_ids);
      if (more.empty() || !IsOfScene(model, row.spec)) continue;
      // What stable was rolled back from stays out.
      const std::string from = model.provenance().base_digest();
      if (!ComesFrom(models, there, name, base, from)) continue;
      found.models.push_back(entry->second.path);
      found.run_ids.merge(more);
    } catch (const std::exception& e) {
      spdlog::warn("{}: {}: its runs are left out", row.job.job_id(), e.what());
    }
  }
  return found;
}

bool HasRunsOfOthers(KnownModels& models, const std::string& model_file, const JobRow& row) {
  const auto known = RunIdsOf(models.Of(ModelName(row.job), ModelDigest(row.job)));
  const v1alpha1::Model candidate = surrogate::ReadModel(model_file).model;
  return std::ranges::any_of(candidate.provenance().runs(), [&](const auto& run) {
    return !known.contains(run.run_id()) && run.sha256() != row.job.run_sha256();
  });
}

std::vector<std::string> Lacking(const std::string& model_file,
                                 const std::set<std::string>& run_ids) {
  const std::set<std::string> there = RunIdsOf(surrogate::ReadModel(model_file).model);
  std::vector<std::string> lacking;
  std::ranges::set_difference(run_ids, there, std::back_inserter(lacking));
  return lacking;
}

}  // namespace grouser::server
