#include "proto/records/durable_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <stdexcept>

#include "proto/records/model_file.h"
#include "proto/records/os/no_space.h"

namespace grouser::records {
namespace {

constexpr auto Fail = os::ThrowErrno;

class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() {
    if (fd_ >= 0) close(fd_);
  }
  int get() const { return fd_; }
  // close() may report a write error late (NFS, quota).
  int Close() {
    const int fd = fd_;
    fd_ = -1;
    return close(fd);
  }

 private:
  int fd_;
};

// Removes the file aside unless the rename has taken it away.
class Aside {
 public:
  explicit Aside(std::string path) : path_(std::move(path)) {}
  Aside(const Aside&) = delete;
  Aside& operator=(const Aside&) = delete;
  ~Aside() {
    if (!path_.empty()) unlink(path_.c_str());
  }
  void Release() { path_.clear(); }

 private:
  std::string path_;
};

// O_EXCL with process, thread and attempt in the name: no two writers share a
// file, and the mode follows the umask (mkstemp would give 0600).
int CreateAside(const std::string& path, std::string* aside) {
  for (int attempt = 0;; ++attempt) {
    *aside = path + "." + std::to_string(getpid()) + "-" + std::to_string(gettid()) + "-" +
             std::to_string(attempt) + kTemporarySuffix;
    const int fd = open(aside->c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (fd >= 0 || errno != EEXIST || attempt > 1000) return fd;
  }
}

int WriteAll(int fd, const std::string& bytes) {
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t n = write(fd, bytes.data() + done, bytes.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return errno;
    done += static_cast<std::size_t>(n);
  }
  return 0;
}

const char* KindOf(mode_t mode) {
  if (S_ISDIR(mode)) return "a folder";
  if (S_ISFIFO(mode)) return "a FIFO";
  if (S_ISCHR(mode) || S_ISBLK(mode)) return "a device";
  return "a special file";
}

void WriteAside(const std::string& path, const std::string& bytes, bool sync) {
  std::string aside_path;
  Descriptor fd(CreateAside(path, &aside_path));
  if (fd.get() < 0) Fail(path, "cannot create", errno);
  Aside aside(aside_path);
  if (const int error = WriteAll(fd.get(), bytes)) Fail(path, "cannot write", error);
  if (sync && fsync(fd.get()) != 0) Fail(path, "cannot sync", errno);
  if (fd.Close() != 0) Fail(path, "cannot close", errno);
  if (rename(aside_path.c_str(), path.c_str()) != 0) Fail(path, "cannot rename into place", errno);
  aside.Release();
}

}  // namespace

void SyncName(const std::string& path) {
  const auto parent = std::filesystem::path(path).parent_path();
  const std::string folder = parent.empty() ? std::string(1, '.') : parent.string();
  Descriptor fd(open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (fd.get() < 0) Fail(folder, "cannot open folder", errno);
  // Some file systems cannot sync a folder and say EINVAL.
  if (fsync(fd.get()) != 0 && errno != EINVAL) Fail(folder, "cannot sync folder", errno);
}

void MakeFolderDurably(const std::string& path) {
  const auto parent = std::filesystem::path(path).parent_path().string();
  std::error_code unknown;
  if (!parent.empty() && !std::filesystem::exists(parent, unknown)) MakeFolderDurably(parent);
  if (mkdir(path.c_str(), 0777) != 0) {
    const int error = errno;
    if (error != EEXIST || !std::filesystem::is_directory(path, unknown)) {
      Fail(path, "cannot be made", error);
    }
  }
  SyncName(path);
}

void MakeFolderFor(const std::string& path) {
  const auto parent = std::filesystem::path(path).parent_path();
  std::error_code unknown;
  if (!parent.empty() && !std::filesystem::is_directory(parent, unknown)) {
    MakeFolderDurably(parent.string());
  }
}

void WriteFileUnsynced(const std::string& path, const std::string& bytes) {
  WriteAside(path, bytes, /*sync=*/false);
}

void WriteFileDurably(const std::string& path, const std::string& bytes) {
  WriteAside(path, bytes, /*sync=*/true);
  SyncName(path);
}

void RenameFolderDurably(const std::string& from, const std::string& to) {
  SyncName(from + "/.");
  for (const auto& entry : std::filesystem::recursive_directory_iterator(from)) {
    if (entry.is_directory()) SyncName(entry.path().string() + "/.");
  }
  if (rename(from.c_str(), to.c_str()) != 0) Fail(to, "cannot rename into place", errno);
  SyncName(to);
}

std::string ReadFileBytes(const std::string& path, std::uint64_t max_bytes) {
  // O_NONBLOCK: opening a FIFO would wait for a writer.
  Descriptor fd(open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY));
  if (fd.get() < 0) Fail(path, "cannot open", errno);
  struct stat info {};
  if (fstat(fd.get(), &info) != 0) Fail(path, "cannot stat", errno);
  if (!S_ISREG(info.st_mode)) {
    throw std::runtime_error(path + ": not a regular file but " + KindOf(info.st_mode));
  }
  if (static_cast<std::uint64_t>(info.st_size) > max_bytes) {
    throw std::runtime_error(path + ": " + std::to_string(info.st_size) +
                             " bytes, expected at most " + std::to_string(max_bytes));
  }
  std::string bytes(static_cast<std::size_t>(info.st_size), '\0');
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t n = read(fd.get(), bytes.data() + done, bytes.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) Fail(path, "cannot read", errno);
    if (n == 0) break;
    done += static_cast<std::size_t>(n);
  }
  bytes.resize(done);
  return bytes;
}

std::string ReadInputFile(const std::string& path, const std::string& expected) {
  try {
    return ReadFileBytes(path);
  } catch (const std::runtime_error& error) {
    throw std::invalid_argument(std::string(error.what()) + ", expected " + expected);
  }
}

}  // namespace grouser::records
