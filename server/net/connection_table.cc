#include "server/net/connection_table.h"

#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>

#include <algorithm>
#include <vector>

namespace grouser::server {
namespace {

/// 0 for what is not an open socket.
ino_t InodeOf(int fd) {
  struct stat file {};
  return ::fstat(fd, &file) == 0 && S_ISSOCK(file.st_mode) ? file.st_ino : 0;
}

}  // namespace

void ConnectionTable::Add(int fd) {
  const std::lock_guard lock(mutex_);
  inode_of_[fd] = InodeOf(fd);
}

void ConnectionTable::ForgetClosed() {
  std::erase_if(inode_of_, [](const auto& item) { return InodeOf(item.first) != item.second; });
}

std::size_t ConnectionTable::CountOpen() {
  const std::lock_guard lock(mutex_);
  ForgetClosed();
  return inode_of_.size();
}

bool ConnectionTable::IsFull() {
  const std::lock_guard lock(mutex_);
  if (inode_of_.size() < max_open_) return false;
  ForgetClosed();
  return inode_of_.size() >= max_open_;
}

std::size_t ConnectionTable::CountWaiting() {
  std::vector<pollfd> polls;
  {
    const std::lock_guard lock(mutex_);
    ForgetClosed();
    polls.reserve(inode_of_.size());
    for (const auto& [fd, inode] : inode_of_) polls.push_back({fd, POLLIN, 0});
  }
  ::poll(polls.data(), polls.size(), 0);
  return static_cast<std::size_t>(
      std::ranges::count_if(polls, [](const pollfd& p) { return (p.revents & POLLIN) != 0; }));
}

void ConnectionTable::EndAll() {
  const std::lock_guard lock(mutex_);
  ForgetClosed();
  for (const auto& [fd, inode] : inode_of_) ::shutdown(fd, SHUT_RD);
}

}  // namespace grouser::server
