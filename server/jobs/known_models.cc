#include "server/jobs/known_models.h"

#include <utility>

#include "server/jobs/job_files.h"
#include "surrogate/model_io/upgrade.h"

namespace grouser::server {

const v1alpha1::Model& KnownModels::Of(const std::string& name, const std::string& digest) {
  if (const auto known = models_.find(digest); known != models_.end()) return known->second;
  const v1alpha1::Model whole =
      surrogate::ReadModel(repository_.Resolve(ReferenceOf(name, digest)).path).model;
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
  std::erase_if(models_, [&](const auto& known) { return !digests.contains(known.first); });
}

}  // namespace grouser::server
