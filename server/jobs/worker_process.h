#pragma once

#include <sys/types.h>

#include <cstdint>
#include <string>
#include <vector>

#include "proto/records/os/unique_fd.h"

namespace grouser::server {

struct WorkerLimits {
  int nice = 10;                                        ///< added to this program's, up to 19
  bool idle = false;                                    ///< SCHED_IDLE
  std::uint64_t memory_bytes = std::uint64_t{8} << 30;  ///< address space; 0: unbounded
  std::uint64_t file_bytes = 0;                         ///< of one file it writes; 0: unbounded
};

/// What to run and where. Paths are absolute.
struct WorkerCommand {
  std::vector<std::string> argv;  ///< argv[0]: path of the program
  std::string folder;             ///< working directory
  std::string stdout_path, log_path;
  os::UniqueFd lock;  ///< of the job folder; becomes its standard input
  WorkerLimits limits;
  double timeout_s = 0;  ///< 0: none
};

/// How a worker ended.
struct WorkerEnd {
  int exit_code = -1;  ///< -1: did not exit by itself
  int signal = 0;      ///< that killed it
  bool timed_out = false;
  std::string spawn_error;  ///< it never ran

  bool Exited(int code) const { return exit_code == code; }
  /// "was killed by signal 9 (Killed)", for people.
  std::string Text() const;
};

/// A child process in a session and group of its own, without any descriptor
/// above 2, with default signals, lower priority, bounded memory, and SIGKILL
/// when the spawning *thread* ends: spawn from one that lives as long as the
/// program.
class WorkerProcess {
 public:
  /// Returns when the program runs. Throws std::runtime_error naming the
  /// program and the cause where it cannot be executed.
  static WorkerProcess Spawn(WorkerCommand command);
  ~WorkerProcess();  ///< kills and collects one that still runs
  WorkerProcess(WorkerProcess&&) noexcept = default;
  WorkerProcess& operator=(WorkerProcess&&) = delete;

  pid_t pid() const { return pid_; }
  /// Readable when the process has ended.
  int pidfd() const { return pidfd_.get(); }
  /// To the whole process group. No effect after Reap().
  void SignalGroup(int signal) const;
  /// Waits for the end, kills what is left of the group, collects the child.
  WorkerEnd Reap();

 private:
  WorkerProcess(pid_t pid, os::UniqueFd pidfd, os::UniqueFd lock)
      : pid_(pid), pidfd_(std::move(pidfd)), lock_(std::move(lock)) {}

  pid_t pid_ = -1;
  os::UniqueFd pidfd_, lock_;
  bool reaped_ = false;
};

}  // namespace grouser::server
