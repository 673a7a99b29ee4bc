#include "server/jobs/scheduler_steps.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <filesystem>
#include <stdexcept>

#include "proto/records/message_json.h"
#include "proto/records/os/no_space.h"
#include "proto/records/os/regular_file.h"
#include "server/jobs/work_command.h"
#include "server/jobs/work_request.h"

namespace grouser::server {

StageNames NamesOf(const v1alpha1::Job& job) {
  if (HasWork(job)) return {"work", ProgramOf(job)};
  switch (job.job_state()) {
    case v1alpha1::JOB_STATE_RUNNING:
      return {"dem", "grouser-dem run"};
    case v1alpha1::JOB_STATE_FITTING:
      return {"fit", "grouser-fit refit"};
    case v1alpha1::JOB_STATE_VALIDATING:
      return {"gate", "grouser-fit gate"};
    default:
      return {"none", "no worker"};
  }
}

std::optional<FinishedRun> AdoptableRun(const JobFiles& files, const JobRow& row) {
  const v1alpha1::Job& job = row.job;
  const std::string left = files.WorkerRun(job.job_id());
  std::optional<FinishedRun> run;
  try {
    if (!job.run_sha256().empty()) {
      run = ReadFinishedRun(files.Run(job.run_file()), row.spec);
      if (run->sha256 != job.run_sha256()) {
        throw std::runtime_error(files.Run(job.run_file()) +
                                 ": is not the file that the job's row names");
      }
    } else if (std::filesystem::exists(left)) {
      run = PublishRun(files, row);
    }
  } catch (const os::NoSpace&) {
    throw;  // the run is whole
  } catch (const std::exception& e) {
    spdlog::warn("{}: {}; it is run again", job.job_id(), e.what());
    if (std::filesystem::exists(left)) os::SetAside(left);
    return std::nullopt;
  }
  if (run && run->record.status() == v1alpha1::RUN_STATUS_FAILED) return std::nullopt;
  return run;
}

bool CandidateIsThere(const JobFiles& files, const JobRow& row) {
  const std::string path = files.Candidate(row.job.job_id());
  if (!std::filesystem::exists(path)) return false;
  try {
    CheckCandidate(path, row.job);
    return true;
  } catch (const std::exception& e) {
    spdlog::warn("{}: {}; it is set aside as {} and fitted again", row.job.job_id(), e.what(),
                 os::SetAside(path));
    return false;
  }
}

std::string WhyNotSteady(const v1alpha1::RunRecord& record) {
  return "the DEM run is " + records::ShortName(record.status()) +
         (record.reason().empty() ? "" : " (" + record.reason() + ")") +
         "; only steady runs train a model; its record is kept here";
}

bool GatePassed(const v1alpha1::Job& job) {
  return !job.gate().empty() &&
         std::all_of(job.gate().begin(), job.gate().end(),
                     [](const v1alpha1::GateCheck& check) { return check.passed(); });
}

std::string GateMessage(const v1alpha1::Job& job) {
  if (GatePassed(job)) return "candidate passes the gate; promote to use it";
  std::string failed;  // with number and limit, as the gate's details begin
  for (const auto& check : job.gate()) {
    if (check.passed()) continue;
    const std::string number = check.detail().substr(0, check.detail().find(':'));
    failed += (failed.empty() ? "" : "; ") + check.name() + " (" + number + ")";
  }
  return "candidate fails the gate: " + failed;
}

}  // namespace grouser::server
