#include "server/query/log/query_log_format.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <boost/crc.hpp>
#include <cerrno>

#include "proto/records/os/no_space.h"
#include "proto/records/os/regular_file.h"

namespace grouser::server {
namespace {

void PutUint32(std::uint32_t value, std::uint8_t* to) {
  for (int i = 0; i < 4; ++i) to[i] = static_cast<std::uint8_t>(value >> (8 * i));
}

std::uint32_t GetUint32(const std::uint8_t* from) {
  std::uint32_t value = 0;
  for (int i = 0; i < 4; ++i) value |= std::uint32_t{from[i]} << (8 * i);
  return value;
}

}  // namespace

std::uint32_t RecordChecksum(std::span<const std::uint8_t> message) {
  std::array<std::uint8_t, 4> length;
  PutUint32(static_cast<std::uint32_t>(message.size()), length.data());
  boost::crc_32_type crc;
  crc.process_bytes(length.data(), length.size());
  crc.process_bytes(message.data(), message.size());
  return crc.checksum();
}

void WriteFrame(const RecordFrame& frame, std::span<std::uint8_t, kFrameBytes> to) {
  PutUint32(frame.bytes, to.data());
  PutUint32(frame.checksum, to.data() + 4);
}

RecordFrame ReadFrame(std::span<const std::uint8_t, kFrameBytes> from) {
  return {GetUint32(from.data()), GetUint32(from.data() + 4)};
}

LogContent LogContentOf(const std::string& path) {
  struct stat info {};
  if (::lstat(path.c_str(), &info) != 0) {
    if (errno == ENOENT) return LogContent::kMissing;
    os::ThrowErrno(path, "cannot be looked at");
  }
  if (!S_ISREG(info.st_mode)) return LogContent::kForeign;
  const os::UniqueFd fd = os::OpenRegular(path, O_RDONLY | O_NOFOLLOW);
  std::array<std::uint8_t, kQueryLogMagic.size() + kFrameBytes> head{};
  const ssize_t n = ::pread(fd.get(), head.data(), head.size(), 0);
  if (n < 0) os::ThrowErrno(path, "cannot be read");
  const auto there = std::min(static_cast<std::size_t>(n), kQueryLogMagic.size());
  if (!std::equal(head.begin(), head.begin() + static_cast<std::ptrdiff_t>(there),
                  kQueryLogMagic.begin())) {
    return LogContent::kForeign;
  }
  if (static_cast<std::size_t>(n) < head.size()) return LogContent::kNoQueries;  // of a kill
  const RecordFrame first = ReadFrame(std::span<const std::uint8_t>(head).last<kFrameBytes>());
  const bool more = static_cast<std::uint64_t>(info.st_size) > head.size() + first.bytes;
  return more ? LogContent::kQueries : LogContent::kNoQueries;
}

}  // namespace grouser::server
