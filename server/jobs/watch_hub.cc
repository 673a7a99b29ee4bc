#include "server/jobs/watch_hub.h"

#include "server/jobs/job_state.h"

namespace grouser::server {

void WatchHub::Add(const std::string& job_id, std::weak_ptr<JobWatcher> watcher) {
  auto& of_job = watchers_[job_id];
  // Those who went away would else pile up on a job that never changes.
  std::erase_if(of_job, [](const auto& other) { return other.expired(); });
  of_job.push_back(std::move(watcher));
}

void WatchHub::Publish(const v1alpha1::Job& job) {
  const auto found = watchers_.find(job.job_id());
  if (found == watchers_.end()) return;
  std::erase_if(found->second, [&](const auto& weak) {
    const auto watcher = weak.lock();
    if (watcher != nullptr) watcher->OnJob(job);
    return watcher == nullptr;
  });
  if (found->second.empty() || HasEnded(job.job_state())) watchers_.erase(found);
}

void WatchHub::Stop() {
  for (const auto& [job_id, of_job] : watchers_) {
    for (const auto& weak : of_job) {
      if (const auto watcher = weak.lock()) watcher->OnStop();
    }
  }
  watchers_.clear();
}

}  // namespace grouser::server
