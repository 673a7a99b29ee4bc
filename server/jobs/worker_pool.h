#pragma once

#include <boost/asio/io_context.hpp>
#include <functional>
#include <memory>
#include <string>
#include <unordered_map>

#include "server/jobs/worker_log.h"
#include "server/jobs/worker_process.h"

namespace grouser::server {

/// Runs worker processes on an event loop: their ends come from pidfds, their
/// progress from their logs. Start and Terminate may be called from any
/// thread; callbacks come on the loop's. The loop must be run by one thread
/// that lives as long as the program (see WorkerProcess).
class WorkerPool {
 public:
  struct Callbacks {
    std::function<void(const ProgressLine&)> on_progress;
    std::function<void(const WorkerEnd&)> on_end;  ///< once, last
  };

  /// A worker that is told to stop has `grace_s` from SIGTERM to SIGKILL.
  WorkerPool(boost::asio::io_context& loop, double grace_s);
  /// Kills what still runs. The loop must have stopped.
  ~WorkerPool();
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;

  /// `key` names the worker for Terminate; at most one a key at a time.
  void Start(std::string key, WorkerCommand command, Callbacks callbacks);
  /// SIGTERM to its group, SIGKILL after the grace. Unknown keys: no effect.
  void Terminate(std::string key);

 private:
  struct Worker;
  void StartOnLoop(const std::string& key, WorkerCommand command, Callbacks callbacks);
  void TerminateOnLoop(Worker& worker);
  void WatchEnd(const std::shared_ptr<Worker>& worker);
  void WatchLog(const std::shared_ptr<Worker>& worker);
  void WatchTime(const std::shared_ptr<Worker>& worker, double timeout_s);

  boost::asio::io_context& loop_;
  double grace_s_;
  std::unordered_map<std::string, std::shared_ptr<Worker>> workers_;
};

}  // namespace grouser::server
