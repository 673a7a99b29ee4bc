#include "server/jobs/refit_plan.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <iterator>
#include <stdexcept>

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

v1alpha1::Model ModelOf(const Repository& repository, const std::string& name,
                        const std::string& digest) {
  return surrogate::ReadModel(repository.Resolve(ReferenceOf(name, digest)).path).model;
}

}  // namespace

bool FollowsStable(const JobRow& row) {
  return row.join_key.starts_with(StableKeyOf(ModelName(row.job)));
}

std::string BaseNow(const Repository& repository, const JobRow& row) {
  const std::string own = ModelDigest(row.job), name = ModelName(row.job);
  if (!FollowsStable(row)) return own;
  const std::string stable = repository.ReadAliases().Find(name, std::string(kDefaultAlias));
  if (stable.empty() || stable == own) return own;
  return IsOfScene(ModelOf(repository, name, stable), row.spec) ? stable : own;
}

bool HasRun(const v1alpha1::Model& model, const std::string& sha256) {
  return std::ranges::any_of(model.provenance().runs(), [&](const v1alpha1::RunSummary& run) {
    return run.sha256() == sha256;
  });
}

Companions CompanionsOf(const Repository& repository, const std::vector<JobRow>& open,
                        const JobRow& row) {
  Companions found;
  if (!FollowsStable(row)) return found;
  const std::string name = ModelName(row.job), base = ModelDigest(row.job);
  std::set<std::string> digests;
  for (const JobRow& other : open) {
    if (other.job.job_id() == row.job.job_id() || other.job.model() != row.job.model()) continue;
    if (FollowsStable(other) && GatePassed(other.job)) digests.insert(other.job.candidate_digest());
  }
  try {
    const std::string canary = repository.ReadAliases().Find(name, std::string(kCanaryAlias));
    if (!canary.empty() && canary != base) digests.insert(canary);
  } catch (const std::exception& e) {
    spdlog::warn("{}: {}: the runs of canary are left out", row.job.job_id(), e.what());
  }
  if (digests.empty()) return found;
  const std::set<std::string> known = RunIdsOf(ModelOf(repository, name, base));
  for (const std::string& digest : digests) {
    try {
      const auto entry = repository.Resolve(ReferenceOf(name, digest));
      const v1alpha1::Model model = surrogate::ReadModel(entry.path).model;
      if (model.provenance().base_digest() != base || !IsOfScene(model, row.spec)) continue;
      found.models.push_back(entry.path);
      for (const auto& run : model.provenance().runs()) {
        const bool trains = surrogate::RoleOf(run) == v1alpha1::RUN_ROLE_TRAIN;
        if (trains && !known.contains(run.run_id())) found.run_ids.insert(run.run_id());
      }
    } catch (const std::exception& e) {
      spdlog::warn("{}: {}: its runs are left out", row.job.job_id(), e.what());
    }
  }
  return found;
}

bool HasRunsOfOthers(const Repository& repository, const std::string& model_file,
                     const JobRow& row) {
  const auto known = RunIdsOf(ModelOf(repository, ModelName(row.job), ModelDigest(row.job)));
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
