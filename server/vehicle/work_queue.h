#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace grouser::server {

/// A few threads that do work in the order in which it came, at most so much of it waiting.
class WorkQueue {
 public:
  /// `worker`: which of the threads does it, 0 to threads - 1.
  using Work = std::function<void(int worker)>;

  /// `nice` is added to the nice value of the threads, so that others go first (0: none).
  WorkQueue(int threads, std::size_t most_waiting, int nice);
  /// Does what waits, then ends.
  ~WorkQueue();

  /// False: too much waits already, or the queue ends; `work` is not done then.
  bool Post(Work work);

 private:
  void Run(int worker, int nice);

  const std::size_t most_waiting_;
  std::mutex mutex_;
  std::condition_variable some_;
  std::deque<Work> waiting_;
  bool ends_ = false;
  std::vector<std::jthread> threads_;
};

}  // namespace grouser::server
