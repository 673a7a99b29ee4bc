#pragma once

#include <string>

#include "grouser/v1alpha1/jobs_service.pb.h"
#include "grouser/v1alpha1/model.pb.h"
#include "server/jobs/job_store.h"

namespace grouser::server {

/// The DEM test that refines `model` at the requested state: the model's own
/// soil, wheel and rig (so that its grains, stiffness and box are those of the
/// training runs), the state made canonical, and the seed. Seed 0 means the
/// tile that most of the model's training runs stand on.
/// Throws StatusError(kFailedPrecondition) where the model does not say what
/// a DEM run needs.
v1alpha1::WheelTestSpec BuildSpec(const v1alpha1::Model& model,
                                  const v1alpha1::SubmitRefinementRequest& request);

/// Throws StatusError(kInvalidArgument) for a state that this model's scene cannot run: a load
/// beyond kSceneLighter and kSceneHeavier times those of its runs (grains and bed are made for
/// those), a speed beyond kSceneFaster times the rig's.
void CheckScene(const v1alpha1::Model& model, const v1alpha1::WheelTestSpec& spec);
inline constexpr double kSceneLighter = 4, kSceneHeavier = 3, kSceneFaster = 10;

/// Whether a run of this spec belongs to the model: its soil, wheel and rig.
bool IsOfScene(const v1alpha1::Model& model, const v1alpha1::WheelTestSpec& spec);

/// How the join keys of jobs begin that refine what a name's "stable" is.
std::string StableKeyOf(const std::string& name);

/// Equal for requests that are the same work: what is refined (the name, where the request means
/// its "stable", else the digest), a hash of the spec, and the time limit that was asked for, so
/// that nobody's run ends at another's limit.
std::string JoinKeyOf(const std::string& name, const std::string& model_digest,
                      const v1alpha1::WheelTestSpec& spec,
                      const v1alpha1::SubmitRefinementRequest& request);

/// The job of a request, as JobBook::Submit takes it.
JobRow RowOf(const v1alpha1::SubmitRefinementRequest& request, const std::string& name,
             const std::string& model_digest, const v1alpha1::WheelTestSpec& spec);

/// Whether a record answers a spec: soil, wheel, rig, state and seed agree;
/// names and sources, which change no grain, are not compared.
bool Answers(const v1alpha1::RunRecord& record, const v1alpha1::WheelTestSpec& spec);

}  // namespace grouser::server
