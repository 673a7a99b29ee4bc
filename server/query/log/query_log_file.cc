#include "server/query/log/query_log_file.h"

#include <fcntl.h>
#include <google/protobuf/util/time_util.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <utility>

#include "proto/records/os/file_lock.h"
#include "proto/records/os/no_space.h"

namespace grouser::server {
namespace {

constexpr std::size_t kMostWaiting = 256 * 1024;  // bytes before they are written

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

QueryLogFile::QueryLogFile(QueryLogOptions options, v1alpha1::QueryLogHeader header)
    : options_(std::move(options)), header_(std::move(header)) {
  CheckNames();
  lock_ = os::LockWithin(options_.file + ".lock", os::kSpawnS, O_NOFOLLOW, os::kOwnersAlone);
  if (!lock_.valid()) {
    throw QueryLogRefused(options_.file +
                          ": is written by another process, expected a query "
                          "log of its own for each server");
  }
  CheckNames();  // none has come since
  if (LogContentOf(options_.file) == LogContent::kQueries) MakeRoom();
  Open();
}

std::string QueryLogFile::Name(int age) const {
  return age == 0 ? options_.file : options_.file + "." + std::to_string(age);
}

void QueryLogFile::CheckNames() const {
  const std::filesystem::path folder = std::filesystem::path(options_.file).parent_path();
  std::error_code unknown;
  const auto kind = std::filesystem::status(folder.empty() ? "." : folder, unknown).type();
  if (kind != std::filesystem::file_type::directory && kind != std::filesystem::file_type::none) {
    throw QueryLogRefused(options_.file + ": '" + folder.string() +
                          "' is no folder, expected one that is there");
  }
  for (int age = 0; age < options_.files; ++age) {
    if (LogContentOf(Name(age)) != LogContent::kForeign) continue;
    throw QueryLogRefused(Name(age) + ": is no query log of Grouser, expected one or no such file");
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
  fd_.Reset(::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, os::kOwnersAlone));
  if (!fd_.valid()) os::ThrowErrno(path, "cannot be made");
  size_ = 0;
  *header_.mutable_open_time() = google::protobuf::util::TimeUtil::GetCurrentTime();
  head_ = HeadOf(header_);
  Write(head_);
  if (::fdatasync(fd_.get()) != 0) os::ThrowErrno(path, "cannot be synced");
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
