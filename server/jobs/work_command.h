#pragma once

#include <string>
#include <vector>

#include "server/core/status.h"
#include "server/jobs/job_files.h"

namespace grouser::server {

/// What campaigns and calibrations are run by, and how much of them.
struct WorkOptions {
  std::string
      scripts_dir;  ///< checkout with the table of soils and the Python programs; empty: none
  std::string campaigns_dir;  ///< of campaigns, scenes and soils that clients may name; empty: none
  int parallel = 1;           ///< runs of a campaign or points of a calibration at a time
  std::uint32_t max_runs = 500;     ///< of a campaign
  double timeout_s = 24 * 3600;     ///< of each start of one; 0: no limit
  std::uint64_t max_job_bytes = 0;  ///< of a job's folder; 0: no limit
};

/// The programs, and where they are run: paths in command lines are relative to the folder of the
/// job, absolute for programs and the operator's campaigns.
struct WorkPrograms {
  std::string bin_dir, device;
  WorkOptions options;
};

/// A program that looks at a request before it is accepted.
struct CheckStep {
  std::vector<std::string> argv;
  StatusCode otherwise;  ///< of what ends other than by 0 or, bad input, 2
};

/// Throws StatusError(kFailedPrecondition) naming what this machine lacks for the work, or
/// (kInvalidArgument) where the work asks for more than the operator allows.
void CheckMeans(const v1alpha1::Job& job, const WorkPrograms& programs);
std::vector<CheckStep> ChecksOf(const v1alpha1::Job& job, const WorkPrograms& programs);
std::vector<std::string> CommandOf(const v1alpha1::Job& job, const WorkPrograms& programs);
/// For messages: "grouser-dem campaign run".
std::string ProgramOf(const v1alpha1::Job& job);

/// Of a job's folder: input/ as the client sent it, out/ as the program left it.
inline constexpr char kInputFolder[] = "input", kOutFolder[] = "out";

/// What the program has left, of the files that a client may have.
std::vector<v1alpha1::JobResult> ResultsOf(const v1alpha1::Job& job, const JobFiles& files);

/// A part of one of the job's results. Throws StatusError(kNotFound).
v1alpha1::ReadJobFileResponse ReadResult(const v1alpha1::Job& job, const JobFiles& files,
                                         const v1alpha1::ReadJobFileRequest& request);

}  // namespace grouser::server
