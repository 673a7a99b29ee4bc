#pragma once

#include <optional>
#include <string>

#include "server/jobs/job_files.h"

namespace grouser::server {

/// The decisions of the scheduler that start nothing and change nothing.

/// Of the stage that a job is in: file stem of its outputs, and its program for messages.
struct StageNames {
  std::string file, program;
};
StageNames NamesOf(const v1alpha1::Job& job);

/// A run that an earlier life of this job has finished: the file that its row
/// names, if that still has the row's hash, else what a worker left whose end
/// nobody saw. FAILED runs are not taken over. Other jobs' runs of the same
/// spec are not looked for: another engine version may have made them.
std::optional<FinishedRun> AdoptableRun(const JobFiles& files, const JobRow& row);

/// A whole candidate of this job's base and run, left by a worker whose end
/// nobody saw.
bool CandidateIsThere(const JobFiles& files, const JobRow& row);

std::string WhyNotSteady(const v1alpha1::RunRecord& record);
/// "candidate passes the gate", or which checks it fails.
std::string GateMessage(const v1alpha1::Job& job);
bool GatePassed(const v1alpha1::Job& job);

}  // namespace grouser::server
