#include "server/jobs/known_models.h"

#include <utility>

#include "server/jobs/job_files.h"
#include "surrogate/model_io/upgrade.h"

namespace grouser::server {

const v1alpha1::Model& KnownModels::Of(const std::string& name, const std::string& digest) {
  if (const auto known = models_.find(digest); known != models_.end()) return known->second;
  return Read(repository_.Resolve(ReferenceOf(name, digest)).path, digest);
}

const v1alpha1::Model& KnownModels::Of(const Repository::Entry& entry) {
  const auto known = models_.find(entry.digest);
  return known != models_.end() ? known->second : Read(entry.path, entry.digest);
}

const v1alpha1::Model& KnownModels::Read(const std::string& path, const std::string& digest) {
  const v1alpha1::Model whole = surrogate::ReadModel(path).model;
  v1alpha1::Model kept;
  kept.set_name(whole.name());
  *kept.mutable_soil() = whole.soil();
  *kept.mutable_wheel() = whole.wheel();
  *kept.mutable_rig() = whole.rig();
  kept.mutable_provenance()->set_base_digest(whole.provenance().base_digest());
  for (const v1alpha1::RunSummary& run : whole.provenance().runs()) {
    auto* one = kept.mutable_provenance()->add_runs();
    one->set_run_id(run.run_id());
    one->set_sha256(run.sha256());
    one->set_role(run.role());
  }
  return models_[digest] = std::move(kept);
}

void KnownModels::KeepOnly(const std::set<std::string>& digests) {
  std::set<std::string> kept;
  for (const std::string& digest : digests) {
    auto known = models_.find(digest);
    for (int step = 0; known != models_.end() && step <= kMostAncestors; ++step) {
      kept.insert(known->first);
      known = models_.find(known->second.provenance().base_digest());
    }
  }
  std::erase_if(told_, [&](const std::string& digest) { return !digests.contains(digest); });
  std::erase_if(models_, [&](const auto& known) { return !kept.contains(known.first); });
}

}  // namespace grouser::server
