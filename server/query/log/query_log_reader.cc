#include "server/query/log/query_log_reader.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <stdexcept>

#include "proto/records/os/no_space.h"
#include "proto/records/os/regular_file.h"

namespace grouser::server {

QueryLogReader::QueryLogReader(const std::string& path)
    : path_(path), fd_(os::OpenRegular(path, O_RDONLY)) {
  std::array<std::uint8_t, kQueryLogMagic.size()> magic{};
  const std::size_t there = Read(magic.data(), magic.size());
  if (there < magic.size() || !std::ranges::equal(magic, kQueryLogMagic)) {
    throw std::runtime_error(path +
                             ": is no query log, expected one that grouser-server "
                             "--query-log of this version wrote");
  }
  at_ = magic.size();
  if (!ReadRecord(&header_)) {
    throw std::runtime_error(problem_.empty() ? path + ": has no header, expected a query log"
                                              : problem_);
  }
}

bool QueryLogReader::Next(v1alpha1::LoggedQuery* query) {
  return problem_.empty() && ReadRecord(query);
}

bool QueryLogReader::ReadRecord(google::protobuf::Message* message) {
  std::array<std::uint8_t, kFrameBytes> head;
  const std::size_t there = Read(head.data(), head.size());
  if (there == 0) return false;
  if (there < head.size()) return Stop(End::kCutOff, "the file ends in a record");
  const RecordFrame frame = ReadFrame(head);
  if (frame.bytes > kMostRecordBytes) {
    return Stop(End::kDamaged, "a record of " + std::to_string(frame.bytes) +
                                   " bytes, expected at most " + std::to_string(kMostRecordBytes));
  }
  bytes_.resize(frame.bytes);
  if (Read(bytes_.data(), bytes_.size()) < bytes_.size()) {
    return Stop(End::kCutOff, "the file ends in a record");
  }
  if (RecordChecksum(bytes_) != frame.checksum) {
    return Stop(End::kDamaged, "a record's checksum is wrong");
  }
  if (!message->ParseFromArray(bytes_.data(), static_cast<int>(bytes_.size()))) {
    return Stop(End::kDamaged, "a record is no message of this version");
  }
  at_ += kFrameBytes + bytes_.size();
  return true;
}

std::size_t QueryLogReader::Read(std::uint8_t* to, std::size_t bytes) {
  std::size_t done = 0;
  while (done < bytes) {
    const ssize_t n = ::read(fd_.get(), to + done, bytes - done);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) os::ThrowErrno(path_, "cannot be read");
    if (n == 0) break;
    done += static_cast<std::size_t>(n);
  }
  return done;
}

bool QueryLogReader::Stop(End end, const std::string& why) {
  end_ = end;
  struct stat info {};
  if (::fstat(fd_.get(), &info) != 0) os::ThrowErrno(path_, "cannot be looked at");
  const auto size = static_cast<std::uint64_t>(info.st_size);
  const std::uint64_t left = size - std::min(size, at_);
  problem_ = path_ + ": byte " + std::to_string(at_) + ": " + why +
             "; what is before it was read, these " + std::to_string(left) + " bytes not";
  return false;
}

}  // namespace grouser::server
