#pragma once

#include <spdlog/spdlog.h>
#include <sys/stat.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

namespace grouser::server {

/// What was read of some files, read again when one of them has changed. What
/// cannot be read then leaves the last good one in place and is logged.
/// Thread-safe; nobody waits while another thread reads.
template <class T>
class Reloaded {
 public:
  static constexpr std::chrono::milliseconds kBetweenLooks{250};

  /// Reads. Throws what `read` throws; `what` names the thing in the log.
  Reloaded(std::string what, std::vector<std::string> files, std::function<T()> read)
      : what_(std::move(what)),
        files_(std::move(files)),
        read_(std::move(read)),
        stamps_(Stamps()),
        current_(std::make_shared<const T>(read_())) {}

  /// Looks at the files where that was not done just before.
  std::shared_ptr<const T> Current() {
    const auto now = std::chrono::steady_clock::now().time_since_epoch().count();
    if (now >= next_look_.load(std::memory_order_relaxed) && looking_.try_lock()) {
      const std::lock_guard lock(looking_, std::adopt_lock);
      next_look_ = now + std::chrono::steady_clock::duration(kBetweenLooks).count();
      Look();
    }
    return current_.load(std::memory_order_acquire);
  }

 private:
  using Stamp = std::tuple<dev_t, ino_t, off_t, time_t, long>;

  std::vector<Stamp> Stamps() const {
    std::vector<Stamp> stamps;
    for (const std::string& file : files_) {
      struct stat s {};
      ::stat(file.c_str(), &s);  // zeros for one that is not there
      stamps.emplace_back(s.st_dev, s.st_ino, s.st_size, s.st_mtim.tv_sec, s.st_mtim.tv_nsec);
    }
    return stamps;
  }

  void Look() {
    auto stamps = Stamps();
    if (stamps == stamps_ && problem_.empty()) return;
    stamps_ = std::move(stamps);
    try {
      current_.store(std::make_shared<const T>(read_()), std::memory_order_release);
      problem_.clear();
      spdlog::info("{}: read again", what_);
    } catch (const std::exception& e) {
      if (problem_ == e.what()) return;  // files that belong together may change one by one
      problem_ = e.what();
      spdlog::error("{}: {}; what was read before stays in force", what_, problem_);
    }
  }

  const std::string what_;
  const std::vector<std::string> files_;
  const std::function<T()> read_;
  std::mutex looking_;
  std::vector<Stamp> stamps_;  // these two under looking_
  std::string problem_;
  std::atomic<std::chrono::steady_clock::rep> next_look_{0};
  std::atomic<std::shared_ptr<const T>> current_;
};

}  // namespace grouser::server
