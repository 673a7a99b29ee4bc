// Takes the calls of the C library that change files: to be loaded into a program by LD_PRELOAD, or
// linked into a test. Below one folder they are counted and fail as FaultControl says; a sync there
// only records what would be on disk (see write_faults_control.h), since the test decides what is.
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

#include "tests/unit/jobs/write_faults_control.h"

namespace grouser::server::testing {
namespace {

FaultControl* control = nullptr;
char root[512], record[512];
bool counts = false;  // this program's calls

/// Absolute, of what a call names. (The programs under test give no "..".)
class Path {
 public:
  explicit Path(int fd) { ReadLink(fd); }
  Path(int folder, const char* name) {
    if (name == nullptr || *name == '/') {
      snprintf(text_, sizeof text_, "%s", name == nullptr ? "" : name);
      return;
    }
    ReadLink(folder);
    const std::size_t size = strlen(text_);
    snprintf(text_ + size, sizeof text_ - size, "/%s", name);
  }
  const char* text() const { return text_; }
  bool taken() const {
    const std::size_t size = strlen(root);
    return control != nullptr && strncmp(text_, root, size) == 0 &&
           (text_[size] == 0 || text_[size] == '/');
  }

 private:
  void ReadLink(int fd) {
    if (control == nullptr) return;
    char link[64] = "/proc/self/cwd";
    if (fd != AT_FDCWD) snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
    const long n = syscall(SYS_readlinkat, AT_FDCWD, link, text_, sizeof text_ - 1);
    text_[n > 0 ? n : 0] = 0;
  }
  char text_[1024] = "";
};

enum class Turn { kGo, kHalf, kFail };

/// What becomes of a call. kHalf: half of it, then the process is killed or the next one fails.
Turn TurnOf(WriteCall call, const Path& path) {
  if (control == nullptr || !path.taken()) return Turn::kGo;
  const int saved = errno;
  const WriteFault fault = control->fault;
  const bool meant = (control->calls & call) != 0 && strstr(path.text(), control->path) != nullptr;
  bool now = false;
  if (fault != WriteFault::kNone && counts && meant && !control->full) {
    ++control->seen;
    now = control->left.fetch_sub(1) == 1;
  }
  if (now && fault == WriteFault::kKill && call != kWrite) kill(getpid(), SIGKILL);
  if (now && fault == WriteFault::kTerm) kill(getpid(), SIGTERM);
  if (now && fault == WriteFault::kFull) control->full = true;
  const bool half = now && fault != WriteFault::kTerm && call == kWrite;
  if (!half && control->full && meant) {
    errno = ENOSPC;
    return Turn::kFail;
  }
  errno = saved;
  return half ? Turn::kHalf : Turn::kGo;
}

bool Fails(WriteCall call, const Path& path) { return TurnOf(call, path) == Turn::kFail; }

/// `write`: a write of so many bytes.
template <typename Write>
ssize_t TakenWrite(int fd, std::size_t size, Write write) {
  const Turn turn = control == nullptr ? Turn::kGo : TurnOf(kWrite, Path(fd));
  if (turn == Turn::kFail) return -1;
  if (turn == Turn::kGo) return write(size);
  const ssize_t done = size > 1 ? write(size / 2) : 0;
  if (control->fault == WriteFault::kKill) kill(getpid(), SIGKILL);
  if (done == 0) errno = ENOSPC;
  return done == 0 ? -1 : done;
}

int TakenOpen(int folder, const char* name, int flags, mode_t mode) {
  if (control != nullptr && (flags & (O_CREAT | O_TRUNC)) != 0) {
    const Path path(folder, name);
    const bool there = syscall(SYS_faccessat, folder, name, F_OK) == 0;
    if (!there && (flags & O_CREAT) != 0 && Fails(kCreate, path)) return -1;
    if (there && (flags & O_TRUNC) != 0 && Fails(kResize, path)) return -1;
  }
  return static_cast<int>(syscall(SYS_openat, folder, name, flags, mode));
}

int TakenSync(int fd) {
  const Path path(fd);
  if (!path.taken()) return static_cast<int>(syscall(SYS_fsync, fd));
  if (Fails(kSync, path)) return -1;
  struct stat info {};
  if (fstat(fd, &info) == 0) (S_ISDIR(info.st_mode) ? RecordFolder : RecordFile)(record, fd);
  return 0;
}

int TakenRename(int from_folder, const char* from, int to_folder, const char* to, unsigned flags) {
  if (Fails(kRename, Path(to_folder, to))) return -1;
  return static_cast<int>(syscall(SYS_renameat2, from_folder, from, to_folder, to, flags));
}

int TakenRemove(int folder, const char* name, int flags) {
  if (Fails(kRemove, Path(folder, name))) return -1;
  return static_cast<int>(syscall(SYS_unlinkat, folder, name, flags));
}

int TakenResize(int fd, off_t size) {
  if (Fails(kResize, Path(fd))) return -1;
  return static_cast<int>(syscall(SYS_ftruncate, fd, size));
}

mode_t ModeOf(int flags, va_list list) { return (flags & O_CREAT) != 0 ? va_arg(list, mode_t) : 0; }

__attribute__((constructor)) void TakeFromTheStart() {
#ifdef GROUSER_PRELOADED
  TakeWriteCalls();
#endif
}

}  // namespace

void TakeWriteCalls() {
  const char* folder = getenv(kFaultsFolder);
  const char* below = getenv(kFaultsRoot);
  if (folder == nullptr || below == nullptr || control != nullptr) return;
  snprintf(root, sizeof root, "%s", below);
  snprintf(record, sizeof record, "%s", folder);
  char path[600];
  snprintf(path, sizeof path, "%s/control", folder);
  const long fd = syscall(SYS_openat, AT_FDCWD, path, O_RDWR | O_CLOEXEC, 0);
  void* memory = mmap(nullptr, sizeof(FaultControl), PROT_READ | PROT_WRITE, MAP_SHARED,
                      static_cast<int>(fd), 0);
  syscall(SYS_close, fd);
  if (memory == MAP_FAILED) return;
  auto* shared = static_cast<FaultControl*>(memory);
  counts = strcmp(program_invocation_short_name, shared->program) == 0;
  control = shared;
}

}  // namespace grouser::server::testing

// The compiler knows some of these names with attributes that it wants repeated.
#pragma GCC diagnostic ignored "-Wattributes"

using namespace grouser::server::testing;  // NOLINT: this file is its implementation

extern "C" {

int open(const char* name, int flags, ...) {
  va_list list;
  va_start(list, flags);
  const mode_t mode = ModeOf(flags, list);
  va_end(list);
  return TakenOpen(AT_FDCWD, name, flags, mode);
}
int openat(int folder, const char* name, int flags, ...) {
  va_list list;
  va_start(list, flags);
  const mode_t mode = ModeOf(flags, list);
  va_end(list);
  return TakenOpen(folder, name, flags, mode);
}
int open64(const char* name, int flags, ...) __attribute__((alias("open")));
int openat64(int folder, const char* name, int flags, ...) __attribute__((alias("openat")));
int creat(const char* name, mode_t mode) {
  return TakenOpen(AT_FDCWD, name, O_CREAT | O_WRONLY | O_TRUNC, mode);
}
int mkdir(const char* name, mode_t mode) noexcept {
  if (Fails(kCreate, Path(AT_FDCWD, name))) return -1;
  return static_cast<int>(syscall(SYS_mkdirat, AT_FDCWD, name, mode));
}
ssize_t write(int fd, const void* bytes, size_t size) {
  return TakenWrite(fd, size, [&](size_t n) { return syscall(SYS_write, fd, bytes, n); });
}
ssize_t writev(int fd, const iovec* parts, int count) {
  return TakenWrite(fd, 1, [&](size_t) { return syscall(SYS_writev, fd, parts, count); });
}
ssize_t pwrite(int fd, const void* bytes, size_t size, off_t at) {
  return TakenWrite(fd, size, [&](size_t n) { return syscall(SYS_pwrite64, fd, bytes, n, at); });
}
ssize_t pwrite64(int fd, const void* bytes, size_t size, off_t at) __attribute__((alias("pwrite")));
ssize_t copy_file_range(int in, off64_t* in_at, int fd, off64_t* at, size_t size, unsigned flags) {
  return TakenWrite(fd, size, [&](size_t n) {
    return syscall(SYS_copy_file_range, in, in_at, fd, at, n, flags);
  });
}
int fsync(int fd) { return TakenSync(fd); }
int fdatasync(int fd) { return TakenSync(fd); }
int rename(const char* from, const char* to) noexcept {
  return TakenRename(AT_FDCWD, from, AT_FDCWD, to, 0);
}
int renameat(int from_folder, const char* from, int to_folder, const char* to) noexcept {
  return TakenRename(from_folder, from, to_folder, to, 0);
}
int renameat2(int from_folder, const char* from, int to_folder, const char* to,
              unsigned flags) noexcept {
  return TakenRename(from_folder, from, to_folder, to, flags);
}
int unlink(const char* name) noexcept { return TakenRemove(AT_FDCWD, name, 0); }
int rmdir(const char* name) noexcept { return TakenRemove(AT_FDCWD, name, AT_REMOVEDIR); }
int unlinkat(int folder, const char* name, int flags) noexcept {
  return TakenRemove(folder, name, flags);
}
int ftruncate(int fd, off_t size) noexcept { return TakenResize(fd, size); }
int ftruncate64(int fd, off_t size) noexcept __attribute__((alias("ftruncate")));
}
