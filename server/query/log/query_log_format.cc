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

constexpr std::size_t kBlock = 4096;  // bytes; headers take some 200

std::size_t ReadAt(const std::string& path, int fd, std::uint64_t at, std::span<std::uint8_t> to) {
  std::size_t done = 0;
  while (done < to.size()) {
    const ssize_t n =
        ::pread(fd, to.data() + done, to.size() - done, static_cast<off_t>(at + done));
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) os::ThrowErrno(path, "cannot be read");
    if (n == 0) break;
    done += static_cast<std::size_t>(n);
  }
  return done;
}

/// What a file system may leave of one that was never written out.
bool AllZeros(const std::string& path, int fd) {
  std::array<std::uint8_t, kBlock> block;
  std::uint64_t at = 0;
  while (const std::size_t n = ReadAt(path, fd, at, block)) {
    if (std::any_of(block.begin(), block.begin() + n, [](std::uint8_t byte) { return byte != 0; }))
      return false;
    at += n;
  }
  return true;
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
  std::array<std::uint8_t, kBlock> head{};
  const auto read = std::span(head).first(ReadAt(path, fd.get(), 0, head));
  const std::size_t there = std::min(read.size(), kQueryLogMagic.size());
  if (!std::ranges::equal(read.first(there), kQueryLogMagic.substr(0, there))) {
    return AllZeros(path, fd.get()) ? LogContent::kNoQueries : LogContent::kForeign;
  }
  constexpr std::size_t kHeader = kQueryLogMagic.size() + kFrameBytes;  // where its message is
  if (read.size() <= kHeader) return LogContent::kNoQueries;
  const RecordFrame frame =
      ReadFrame(std::span<const std::uint8_t>(read).subspan<kQueryLogMagic.size(), kFrameBytes>());
  const auto rest = read.subspan(kHeader);
  if (frame.bytes > rest.size() || RecordChecksum(rest.first(frame.bytes)) != frame.checksum) {
    return LogContent::kQueries;
  }
  const bool more = static_cast<std::uint64_t>(info.st_size) > kHeader + frame.bytes;
  return more ? LogContent::kQueries : LogContent::kNoQueries;
}

}  // namespace grouser::server
