#include "server/vehicle/work_queue.h"

#include <sys/resource.h>
#include <unistd.h>

#include <utility>

namespace grouser::server {

WorkQueue::WorkQueue(int threads, std::size_t most_waiting, int nice)
    : most_waiting_(most_waiting) {
  for (int t = 0; t < threads; ++t) threads_.emplace_back([this, t, nice] { Run(t, nice); });
}

WorkQueue::~WorkQueue() {
  {
    const std::lock_guard lock(mutex_);
    ends_ = true;
  }
  some_.notify_all();
}

bool WorkQueue::Post(Work work) {
  {
    const std::lock_guard lock(mutex_);
    if (ends_ || waiting_.size() >= most_waiting_) return false;
    waiting_.push_back(std::move(work));
  }
  some_.notify_one();
  return true;
}

void WorkQueue::Run(int worker, int nice) {
  // On Linux this is the priority of the calling thread alone. Where it is refused, all are equal.
  if (nice != 0) ::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), nice);
  std::unique_lock lock(mutex_);
  while (true) {
    some_.wait(lock, [this] { return ends_ || !waiting_.empty(); });
    if (waiting_.empty()) return;
    const Work work = std::move(waiting_.front());
    waiting_.pop_front();
    lock.unlock();
    work(worker);
    lock.lock();
  }
}

}  // namespace grouser::server
