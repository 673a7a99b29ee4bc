#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "grouser/v1alpha1/jobs_service.pb.h"

namespace grouser::server {

/// Someone who follows a job. Called on the serial thread; must not block.
class JobWatcher {
 public:
  virtual ~JobWatcher() = default;
  virtual void OnJob(const v1alpha1::Job& job) = 0;
  virtual void OnStop() = 0;  ///< the program stops; nothing more comes
};

/// Passes the changes of jobs on to their watchers. One thread.
class WatchHub {
 public:
  void Add(const std::string& job_id, std::weak_ptr<JobWatcher> watcher);
  void Publish(const v1alpha1::Job& job);
  void Stop();

 private:
  std::map<std::string, std::vector<std::weak_ptr<JobWatcher>>> watchers_;
};

}  // namespace grouser::server
