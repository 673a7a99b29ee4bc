#pragma once

#include <atomic>
#include <string>

#include "dem_offline/campaign/progress.h"
#include "dem_offline/engine/rig/work.h"
#include "dem_offline/scenes/sweep_yaml.h"

namespace grouser::campaign {

struct SweepOptions {
  std::string folder;  ///< made if it is not there
  int jobs = 0;        ///< runs at a time; 0: one per core
  dem::WorkLimits limits;
};

/// Runs the members of a sweep on this machine's cores, longest first, into FOLDER/runs (each a run
/// file and its CSVs, as one experiment has them) and FOLDER/members.csv, the table of all of them.
/// A member that fails is written as FAILED, and the others go on. Members that are in the folder
/// already, DONE or FAILED, with the same values and engine are not run again. A member
/// with a checkpoint goes on from it. When `stop` becomes true, the runs in progress end without a
/// run file.
///
/// Throws InputError for a member that is refused or a folder with other contents, before anything
/// has run; std::runtime_error where the folder is in use or a file cannot be written.
v1alpha1::CampaignStatus RunSweep(const Sweep& sweep, const SweepOptions& options,
                                  const std::atomic<bool>& stop, CampaignProgress& progress);

}  // namespace grouser::campaign
