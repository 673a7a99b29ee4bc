#include "server/net/connection_table.h"

#include <sys/socket.h>
#include <sys/stat.h>

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

void ConnectionTable::EndAll() {
  const std::lock_guard lock(mutex_);
  ForgetClosed();
  for (const auto& [fd, inode] : inode_of_) ::shutdown(fd, SHUT_RD);
}

}  // namespace grouser::server
