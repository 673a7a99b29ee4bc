#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <thread>
#include <vector>

namespace grouser::dem {

/// A few threads that split a range the same way every time. The caller is one
/// of them. Not reentrant.
class Team {
 public:
  explicit Team(int threads);
  ~Team();
  Team(const Team&) = delete;
  Team& operator=(const Team&) = delete;

  int size() const { return static_cast<int>(workers_.size()) + 1; }
  /// f(part) for part = 0 .. size() - 1, all at once; returns when all are done.
  void Run(const std::function<void(int)>& f);

 private:
  void Work(int part);

  std::vector<std::thread> workers_;
  const std::function<void(int)>* job_ = nullptr;
  std::atomic<std::uint64_t> round_{0};
  std::atomic<int> busy_{0};
  std::atomic<bool> stop_{false};
};

}  // namespace grouser::dem
