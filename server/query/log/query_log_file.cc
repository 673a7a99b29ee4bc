#include "server/query/log/query_log_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <stdexcept>
#include <utility>

#include "proto/records/os/file_lock.h"
#include "proto/records/os/no_space.h"

namespace grouser::server {
namespace {

constexpr std::size_t kMostWaiting = 256 * 1024;  // bytes before they are written
constexpr mode_t kOwnerAlone = 0600;

void FillFrame(std::span<std::uint8_t> framed) {
  const auto message = framed.subspan(kFrameBytes);
  WriteFrame({static_cast<std::uint32_t>(message.size()), RecordChecksum(message)},
             framed.first<kFrameBytes>());
}

std::vector<std::uint8_t> HeadOf(const v1alpha1::QueryLogHeader& header) {
  std::vector<std::uint8_t> head(kQueryLogMagic.begin(), kQueryLogMagic.end());
  head.resize(head.size() + kFrameBytes + header.ByteSizeLong());
  const auto framed = std::span(head).subspan(kQueryLogMagic.size());
  header.SerializeToArray(framed.data() + kFrameBytes,
                          static_cast<int>(framed.size() - kFrameBytes));
  FillFrame(framed);
  return head;
}

}  // namespace

QueryLogFile::QueryLogFile(QueryLogOptions options, const v1alpha1::QueryLogHeader& header)
    : options_(std::move(options)), head_(HeadOf(header)) {
  lock_ = os::LockWithin(options_.file + ".lock", os::kSpawnS);
  if (!lock_.valid()) {
    throw std::runtime_error(options_.file +
                             ": is written by another process, expected a query "
                             "log of its own for each server");
  }
  CheckNames();
  if (LogContentOf(options_.file) == LogContent::kQueries) MakeRoom();
  Open();
}

std::string QueryLogFile::Name(int age) const {
  return age == 0 ? options_.file : options_.file + "." + std::to_string(age);
}

void QueryLogFile::CheckNames() const {
  for (int age = 0; age < options_.files; ++age) {
    if (LogContentOf(Name(age)) != LogContent::kForeign) continue;
    throw std::runtime_error(Name(age) +
                             ": is no query log of Grouser, expected one or no such file");
  }
}

void QueryLogFile::MakeRoom() {
  CheckNames();
  for (int age = options_.files - 1; age > 0; --age) {
    if (std::rename(Name(age - 1).c_str(), Name(age).c_str()) == 0 || errno == ENOENT) continue;
    os::ThrowErrno(Name(age - 1), "cannot be renamed");
  }
}

void QueryLogFile::Open() {
  const std::string& path = options_.file;
  // What is still there holds no query that is to be kept.
  if (::unlink(path.c_str()) != 0 && errno != ENOENT) os::ThrowErrno(path, "cannot be replaced");
  fd_.Reset(::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, kOwnerAlone));
  if (!fd_.valid()) os::ThrowErrno(path, "cannot be made");
  size_ = 0;
  Write(head_);
}

void QueryLogFile::Append(std::span<std::uint8_t> framed) {
  FillFrame(framed);
  const bool has_some = size_ + waiting_.size() > head_.size();
  if (has_some && size_ + waiting_.size() + framed.size() > options_.max_bytes) {
    Flush();
    MakeRoom();
    Open();
  }
  waiting_.insert(waiting_.end(), framed.begin(), framed.end());
  ++waiting_records_;
  if (waiting_.size() >= kMostWaiting) Flush();
}

void QueryLogFile::Flush() {
  if (waiting_.empty()) return;
  const std::vector<std::uint8_t> bytes = std::exchange(waiting_, {});
  const std::uint64_t count = std::exchange(waiting_records_, 0);
  Write(bytes);
  records_ += count;
}

void QueryLogFile::Write(std::span<const std::uint8_t> bytes) {
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t n = ::write(fd_.get(), bytes.data() + done, bytes.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) {
      const int error = errno;
      // The whole records of before; should this fail as well, a reader stops at the torn one.
      [[maybe_unused]] const int cut = ::ftruncate(fd_.get(), static_cast<off_t>(size_));
      os::ThrowErrno(options_.file, "cannot be written", error);
    }
    done += static_cast<std::size_t>(n);
  }
  size_ += bytes.size();
  all_bytes_ += bytes.size();
}

}  // namespace grouser::server
