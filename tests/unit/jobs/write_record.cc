// The record of what was synced, by system calls alone: the calls of the C library are taken.
#include <dirent.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "tests/unit/jobs/write_faults_control.h"

namespace grouser::server::testing {
namespace {

/// A file of the record, which is there whole or not at all.
class Entry {
 public:
  Entry(const char* record, const char* kind, const char* key) {
    snprintf(path_, sizeof path_, "%s/%s/%s", record, kind, key);
    snprintf(aside_, sizeof aside_, "%s/%s/.%ld", record, kind, syscall(SYS_gettid));
    fd_ = static_cast<int>(
        syscall(SYS_openat, AT_FDCWD, aside_, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600));
  }
  ~Entry() {
    syscall(SYS_close, fd_);
    syscall(SYS_rename, aside_, path_);
  }
  Entry(const Entry&) = delete;
  Entry& operator=(const Entry&) = delete;

  void Add(const char* bytes, long size) {
    while (size > 0) {
      const long n = syscall(SYS_write, fd_, bytes, size);
      if (n <= 0) return;
      bytes += n;
      size -= n;
    }
  }

 private:
  char path_[1024], aside_[1024];
  int fd_;
};

/// To read from the beginning, whatever the descriptor was opened for.
int Reopen(int fd) {
  char path[64];
  snprintf(path, sizeof path, "/proc/self/fd/%d", fd);
  return static_cast<int>(syscall(SYS_openat, AT_FDCWD, path, O_RDONLY | O_CLOEXEC, 0));
}

}  // namespace

bool KeyOf(int fd, const char* name, char (&key)[40], bool* is_folder) {
  struct statx info {};
  const int flags = AT_SYMLINK_NOFOLLOW | (*name == 0 ? AT_EMPTY_PATH : 0);
  if (statx(fd, name, flags, STATX_BASIC_STATS | STATX_BTIME, &info) != 0) return false;
  snprintf(key, sizeof key, "%llx-%llx%08x", static_cast<unsigned long long>(info.stx_ino),
           static_cast<unsigned long long>(info.stx_btime.tv_sec), info.stx_btime.tv_nsec);
  *is_folder = (info.stx_mode & 0170000) == 0040000;
  return true;
}

void RecordFile(const char* record, int fd) {
  char key[40];
  bool is_folder = false;
  const int in = Reopen(fd);
  if (in < 0 || !KeyOf(fd, "", key, &is_folder)) return;
  Entry out(record, "data", key);
  char bytes[65536];
  for (long n = 0; (n = syscall(SYS_read, in, bytes, sizeof bytes)) > 0;) out.Add(bytes, n);
  syscall(SYS_close, in);
}

void RecordFolder(const char* record, int fd) {
  char key[40];
  bool is_folder = false;
  if (!KeyOf(fd, "", key, &is_folder)) return;
  DIR* folder = fdopendir(Reopen(fd));
  if (folder == nullptr) return;
  Entry out(record, "folders", key);
  while (const dirent* found = readdir(folder)) {
    if (strcmp(found->d_name, ".") == 0 || strcmp(found->d_name, "..") == 0) continue;
    char line[400];
    if (!KeyOf(dirfd(folder), found->d_name, key, &is_folder)) continue;
    snprintf(line, sizeof line, "%c %s %s\n", is_folder ? 'd' : 'f', key, found->d_name);
    out.Add(line, static_cast<long>(strlen(line)));
  }
  closedir(folder);
}

}  // namespace grouser::server::testing
