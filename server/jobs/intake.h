#pragma once

#include <cstdint>
#include <exception>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "server/jobs/job_book.h"
#include "server/jobs/job_files.h"
#include "server/jobs/serial_thread.h"
#include "server/jobs/work_command.h"
#include "server/jobs/work_request.h"
#include "server/jobs/worker_pool.h"

namespace grouser::server {

/// Accepts campaigns and calibrations. What a client sends is read first by the programs that will
/// run it, in processes of their own with little memory and time: so the command line's checks are
/// the server's, and no text can harm it. Files lie in jobs/check-ID until then; the folder is
/// renamed before the job is stored, so that a crash leaves no job without its files. All members
/// run on the serial thread.
class Intake {
 public:
  /// With the answer, or why there is none: StatusError, SqliteError or another.
  using Done = std::function<void(std::exception_ptr, const v1alpha1::SubmitJobResponse&)>;

  /// Removes what checks of an earlier life have left.
  Intake(WorkPrograms programs, WorkerLimits limits, const JobFiles& files, JobBook& book,
         WorkerPool& pool, SerialThread& thread);

  /// Calls `done` once, maybe before it returns. Throws as `done` is told.
  void Submit(WorkRequest request, const std::string& who, Done done);
  /// Answers what is being checked with kUnavailable.
  void Stop();

  static constexpr int kMostChecks = 4;         ///< at a time
  static constexpr int kMostOfOne = 2;          ///< at a time of one client
  static constexpr std::size_t kMostAsked = 4;  ///< of one client, those that wait for a turn too
  static constexpr double kCheckS = 30;         ///< longest of one program

 private:
  struct Check {
    WorkRequest request;
    std::string who, folder;
    std::vector<CheckStep> steps;
    std::size_t step = 0;
    Done done;
    std::uint64_t order = 0;  ///< in which they came
    bool runs = false;
  };

  void WriteFiles(const WorkRequest& request, const std::string& folder) const;
  /// As many as may run: of the client for whom the fewest run, then who came first.
  void StartChecks();
  void StartStep(const std::string& id);
  void OnEnd(const std::string& id, const WorkerEnd& end);
  v1alpha1::SubmitJobResponse Accept(const std::string& id, const Check& check);
  std::string Output(const Check& check, const char* ending) const;

  WorkPrograms programs_;
  WorkerLimits limits_;
  const JobFiles& files_;
  JobBook& book_;
  WorkerPool& pool_;
  SerialThread& thread_;
  std::map<std::string, Check> checks_;  ///< by the job that it may become
  std::uint64_t asked_ = 0;
};

}  // namespace grouser::server
