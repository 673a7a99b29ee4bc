#include "proto/lcm/datagram.h"

#include <algorithm>

#include "proto/lcm/byte_reader.h"

namespace grouser::lcm_io {
namespace {

constexpr std::uint64_t kMessageMagic = 0x4c433032;   // "LC02"
constexpr std::uint64_t kFragmentMagic = 0x4c433033;  // "LC03"
constexpr std::size_t kMessageHeader = 8, kFragmentHeader = 20;

}  // namespace

Datagram ParseDatagram(std::span<const std::uint8_t> bytes) noexcept {
  Datagram out;
  ByteReader reader(bytes);
  std::uint64_t magic = 0, sequence = 0;
  if (!reader.Read(4, &magic) || !reader.Read(4, &sequence)) return out;
  out.sequence = static_cast<std::uint32_t>(sequence);
  if (magic == kFragmentMagic && bytes.size() >= kFragmentHeader) {
    out.kind = DatagramKind::kFragment;
    return out;
  }
  if (magic != kMessageMagic) return out;
  const auto rest = bytes.subspan(kMessageHeader);
  const auto name = rest.first(std::min(rest.size(), kMaxChannel + 1));
  const auto end = std::find(name.begin(), name.end(), 0);
  if (end == name.end()) return out;
  const auto length = static_cast<std::size_t>(end - name.begin());
  out.kind = DatagramKind::kMessage;
  out.channel = {reinterpret_cast<const char*>(rest.data()), length};
  out.payload = rest.subspan(length + 1);
  return out;
}

}  // namespace grouser::lcm_io
