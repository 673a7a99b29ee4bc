#include "proto/records/os/file_lock.h"

#include <fcntl.h>
#include <fmt/core.h>
#include <fmt/ranges.h>
#include <signal.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <thread>

namespace grouser::os {
namespace {

namespace fs = std::filesystem;

bool HasOpen(const fs::path& process, const struct stat& file) {
  std::error_code error;
  for (fs::directory_iterator it(process / "fd", error), end; !error && it != end;
       it.increment(error)) {
    struct stat other {};
    if (::stat(it->path().c_str(), &other) == 0 && other.st_dev == file.st_dev &&
        other.st_ino == file.st_ino) {
      return true;
    }
  }
  return false;
}

}  // namespace

UniqueFd TryLock(const std::string& path, int flags, mode_t mode) {
  UniqueFd fd = OpenRegular(path, O_RDWR | O_CREAT | flags, mode);
  while (::flock(fd.get(), LOCK_EX | LOCK_NB) != 0) {
    if (errno == EWOULDBLOCK) return UniqueFd();
    if (errno != EINTR) {
      throw std::runtime_error(path + ": cannot be locked: " + std::strerror(errno));
    }
  }
  return fd;
}

std::vector<pid_t> HoldersOf(const std::string& path) {
  struct stat file {};
  if (::stat(path.c_str(), &file) != 0) return {};
  std::vector<pid_t> holders;
  std::error_code error;
  for (fs::directory_iterator it("/proc", error), end; !error && it != end; it.increment(error)) {
    const std::string name = it->path().filename().string();
    pid_t pid = 0;
    const auto [rest, bad] = std::from_chars(name.data(), name.data() + name.size(), pid);
    if (bad != std::errc() || rest != name.data() + name.size()) continue;
    if (HasOpen(it->path(), file)) holders.push_back(pid);
  }
  return holders;
}

UniqueFd LockWithin(const std::string& path, double timeout_s, int flags, mode_t mode) {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::duration<double>(timeout_s);
  for (;;) {
    UniqueFd lock = TryLock(path, flags, mode);
    if (lock.valid() || std::chrono::steady_clock::now() > deadline) return lock;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
}

UniqueFd LockEvicting(const std::string& path, double timeout_s) {
  UniqueFd lock = LockWithin(path, kSpawnS);  // what is being spawned is not to be killed
  if (lock.valid()) return lock;
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::duration<double>(timeout_s);
  for (;;) {
    const auto holders = HoldersOf(path);
    for (const pid_t pid : holders) {
      if (pid != ::getpid()) ::kill(pid, SIGKILL);
    }
    lock = LockWithin(path, 0.01);
    if (lock.valid()) return lock;
    if (std::chrono::steady_clock::now() > deadline) {
      throw std::runtime_error(fmt::format("{}: still locked by process {}, expected no worker",
                                           path, fmt::join(holders, " ")));
    }
  }
}

}  // namespace grouser::os
