#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace grouser::server {

/// A few threads that do work in the order in which it came, at most so much of it waiting.
class WorkQueue {
 public:
  /// `worker`: which of the threads does it, 0 to threads - 1. Must not throw.
  using Work = std::function<void(int worker)>;

  /// `nice` is added to the nice value of the threads, up to 19, so that others go first (0: none);
  /// where that is refused it is logged once. Throws std::system_error where a thread cannot be
  /// started; those that were have ended then.
  WorkQueue(int threads, std::size_t most_waiting, int nice);
  /// Does what waits, then ends.
  ~WorkQueue();

  /// False: too much waits already, or the queue ends; `work` is not done then. `key` is what
  /// Remove finds it by. Of one `owner` no more may wait than leaves as many places free, so that
  /// one alone has half of them; empty: of nobody, which has no such share.
  bool Post(const void* key, Work work, const std::string& owner = {});
  /// Takes work out that has not begun. False: there is none with this key; it was begun, or done.
  bool Remove(const void* key);
  /// How much waits now.
  std::size_t waiting() const;

 private:
  struct Entry {
    const void* key;
    Work work;
    std::string owner;
  };

  void End();
  void Run(int worker, int nice);

  const std::size_t most_waiting_;
  mutable std::mutex mutex_;
  std::condition_variable some_;
  std::deque<Entry> waiting_;
  bool ends_ = false;
  std::vector<std::jthread> threads_;
};

}  // namespace grouser::server
