#pragma once

#include <cstdint>
#include <span>
#include <string_view>

namespace grouser::lcm_io {

/// Longest name of a channel, without its NUL (LCM_MAX_CHANNEL_NAME_LENGTH).
inline constexpr std::size_t kMaxChannel = 63;
/// Largest payload of a UDP datagram over IPv4.
inline constexpr std::size_t kMaxDatagram = 65507;

enum class DatagramKind {
  kMessage,    ///< a whole message
  kFragment,   ///< a part of a longer one; never put together here
  kMalformed,  ///< neither
};

/// One datagram of LCM's UDP multicast protocol. `channel` and `payload` are
/// those of a message and point into the bytes that were parsed.
struct Datagram {
  DatagramKind kind = DatagramKind::kMalformed;
  std::uint32_t sequence = 0;  ///< of a message or fragment; grows by one a message
  std::string_view channel;
  std::span<const std::uint8_t> payload;
};

/// Checks every length before it is used; any bytes are safe. Layout, big
/// endian: magic "LC02", sequence number (4 bytes), channel with its final NUL,
/// payload. A fragment has magic "LC03", sequence number, sizes and offsets (20
/// bytes in all). Source: liblcm 1.3.1, UDP multicast protocol description.
Datagram ParseDatagram(std::span<const std::uint8_t> bytes) noexcept;

}  // namespace grouser::lcm_io
