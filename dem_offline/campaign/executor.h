#pragma once

#include <atomic>
#include <map>
#include <string>

#include "dem_offline/campaign/backend.h"
#include "dem_offline/campaign/progress.h"
#include "grouser/v1alpha1/campaign.pb.h"

namespace grouser::campaign {

struct ExecutorOptions {
  std::string folder;  ///< campaign folder; made if it is not there
  int jobs = 0;        ///< worker threads; 0: one per core
  std::map<std::string, v1alpha1::RunStatus> known = {};  ///< by run_id: done elsewhere, not run
};

/// Throws InputError for a run that the engine refuses.
void CheckCampaign(const v1alpha1::Campaign& campaign, const Backend& backend);

/// Executor "local": runs a campaign on this machine's cores, one run a
/// thread. Finished runs (a readable run file with the right id) are skipped,
/// so that a killed campaign resumes. When `stop` becomes true, the runs in
/// progress end without a file and the call returns what was done.
///
/// Throws InputError for a spec that the engine refuses or a folder that holds
/// another campaign, before anything has run; std::runtime_error when the
/// folder is in use or a file cannot be written (the disk is full): then all
/// workers stop, and what was finished stays.
v1alpha1::CampaignStatus RunCampaign(const v1alpha1::Campaign& campaign,
                                     const ExecutorOptions& options, const Backend& backend,
                                     const std::atomic<bool>& stop, CampaignProgress& progress);

}  // namespace grouser::campaign
