#include "server/vehicle/work_queue.h"

#include <spdlog/spdlog.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

namespace grouser::server {
namespace {

constexpr int kMostNice = 19;

// Of the calling thread alone, on Linux. False, with errno: refused.
bool AddNice(int more) {
  const auto thread = static_cast<id_t>(::gettid());
  errno = 0;
  const int now = ::getpriority(PRIO_PROCESS, thread);
  if (now == -1 && errno != 0) return false;
  return ::setpriority(PRIO_PROCESS, thread, std::min(now + more, kMostNice)) == 0;
}

}  // namespace

WorkQueue::WorkQueue(int threads, std::size_t most_waiting, int nice)
    : most_waiting_(most_waiting) {
  try {
    for (int t = 0; t < threads; ++t) threads_.emplace_back([this, t, nice] { Run(t, nice); });
  } catch (...) {
    End();
    throw;
  }
}

WorkQueue::~WorkQueue() { End(); }

// Lets the threads end, which are joined as the members go.
void WorkQueue::End() {
  {
    const std::lock_guard lock(mutex_);
    ends_ = true;
  }
  some_.notify_all();
}

bool WorkQueue::Post(const void* key, Work work, const std::string& owner) {
  {
    const std::lock_guard lock(mutex_);
    if (ends_ || waiting_.size() >= most_waiting_) return false;
    const auto own = static_cast<std::size_t>(std::count_if(
        waiting_.begin(), waiting_.end(), [&owner](const Entry& e) { return e.owner == owner; }));
    if (!owner.empty() && own + 1 > most_waiting_ - waiting_.size()) return false;
    waiting_.push_back({key, std::move(work), owner});
  }
  some_.notify_one();
  return true;
}

bool WorkQueue::Remove(const void* key) {
  const std::lock_guard lock(mutex_);
  return std::erase_if(waiting_, [key](const Entry& e) { return e.key == key; }) > 0;
}

std::size_t WorkQueue::waiting() const {
  const std::lock_guard lock(mutex_);
  return waiting_.size();
}

void WorkQueue::Run(int worker, int nice) {
  if (nice != 0 && !AddNice(nice) && worker == 0) {
    spdlog::warn("vehicle threads: nice +{} is refused ({}); they run with the priority of all",
                 nice, std::strerror(errno));
  }
  std::unique_lock lock(mutex_);
  while (true) {
    some_.wait(lock, [this] { return ends_ || !waiting_.empty(); });
    if (waiting_.empty()) return;
    const Work work = std::move(waiting_.front().work);
    waiting_.pop_front();
    lock.unlock();
    work(worker);
    lock.lock();
  }
}

}  // namespace grouser::server
