#pragma once

#include <cstddef>
#include <set>
#include <string>
#include <vector>

#include "server/core/repository.h"
#include "server/jobs/job_store.h"
#include "server/jobs/known_models.h"

namespace grouser::server {

/// What a refinement is fitted from and to, so that candidates of one model have each other's runs.

/// Whether the job refines what its name's "stable" is, wherever that moves; else one digest.
bool FollowsStable(const JobRow& row);

/// Digest of the model that the job is to be fitted from: of one that follows "stable" what that is
/// now, as long as the job's run is of its soil, wheel and rig; else what the job names. Throws
/// std::runtime_error for a damaged alias file.
std::string BaseNow(const Repository& repository, KnownModels& models, const JobRow& row);

/// Whether a model was fitted to a run, by its hash.
bool HasRun(const v1alpha1::Model& model, const std::string& sha256);

/// Refits of one base that one fit takes runs from, and candidates that planning it reads: at most
/// so many; what is left comes with the next fit, which has this one's. Beside these the base is
/// read, and kMostAncestors of its ancestors for a canary that was not fitted from it: once each.
inline constexpr std::size_t kMostCombined = 16;

/// Other refits whose training runs go into the job's candidate: of the open jobs that follow
/// "stable", of the same base, whose candidate passes the gate, the latest first, those that have
/// runs which the others before lack (mostly the latest one has all); before them what "canary"
/// names, of this base or of one that it comes from.
struct Companions {
  std::vector<std::string> models;  ///< files
  std::set<std::string> run_ids;    ///< that the base lacks
  /// Candidates that were not looked at: `left_out`, or beyond kMostCombined.
  std::set<std::string> passed_over = {};
};
/// `models` keeps what `open` names and that comes from. Without `left_out`: what planning a fit
/// has passed over, so that asking again whether it lacks runs finds new candidates alone.
Companions CompanionsOf(const Repository& repository, KnownModels& models,
                        const std::vector<JobRow>& open, const JobRow& row,
                        const std::set<std::string>& left_out = {});

/// Whether a candidate was fitted to runs that neither its base has nor its job has made.
bool HasRunsOfOthers(KnownModels& models, const std::string& model_file, const JobRow& row);

/// Those of `run_ids` that a model file was not fitted to.
std::vector<std::string> Lacking(const std::string& model_file,
                                 const std::set<std::string>& run_ids);

}  // namespace grouser::server
