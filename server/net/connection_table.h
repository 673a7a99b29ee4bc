#pragma once

#include <sys/types.h>

#include <cstddef>
#include <mutex>
#include <unordered_map>

namespace grouser::server {

/// The accepted connections. gRPC owns and closes their descriptors and tells
/// nobody, so a connection counts as open while its descriptor is still the
/// same socket (same inode). Thread-safe.
class ConnectionTable {
 public:
  explicit ConnectionTable(std::size_t max_open) : max_open_(max_open) {}

  void Add(int fd);
  std::size_t CountOpen();
  bool IsFull();
  /// Connections with bytes that nobody has read yet.
  std::size_t CountWaiting();
  /// Every open connection reads end of file: gRPC then closes it after the
  /// writes under way, and the peer sees UNAVAILABLE, not CANCELLED, for calls
  /// that come too late.
  void EndAll();

 private:
  void ForgetClosed();  // needs mutex_

  const std::size_t max_open_;
  std::mutex mutex_;
  std::unordered_map<int, ino_t> inode_of_;
};

}  // namespace grouser::server
