#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace grouser::server {

/// The form of a file of logged queries; records: see query_log.proto.
inline constexpr std::string_view kQueryLogMagic = "grouser-query-log/1\n";
/// Before each message: its length and the checksum, uint32 little endian.
inline constexpr std::size_t kFrameBytes = 8;
/// Longer messages are none: 10,000 states with everything take 4 MB.
inline constexpr std::size_t kMostRecordBytes = std::size_t{64} << 20;

/// CRC-32 (IEEE 802.3) of length and message.
std::uint32_t RecordChecksum(std::span<const std::uint8_t> message);

struct RecordFrame {
  std::uint32_t bytes = 0, checksum = 0;
};
void WriteFrame(const RecordFrame& frame, std::span<std::uint8_t, kFrameBytes> to);
RecordFrame ReadFrame(std::span<const std::uint8_t, kFrameBytes> from);

/// What a file is that has a log's name.
enum class LogContent {
  kMissing,
  kForeign,    ///< something else, or no regular file
  kNoQueries,  ///< empty, all zeros, cut off before its header, or a whole header alone
  kQueries,    ///< a log, and more than that: perhaps behind a header that is torn or damaged
};
/// Only what is known to hold no query is called so: a length counts once its record's checksum is
/// right. Throws std::runtime_error "PATH: cause" where it cannot be read.
LogContent LogContentOf(const std::string& path);

}  // namespace grouser::server
