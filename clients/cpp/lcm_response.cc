#include "clients/cpp/lcm_response.h"

#include <string>
#include <utility>

#include "proto/lcm/byte_reader.h"
#include "proto/lcm/datagram.h"

namespace grouser::client {
namespace {

using grouser_lcm::wheel_measured_t;
using grouser_lcm::wheel_response_t;

constexpr std::size_t kOutputs = 6, kArraysOfOutput = 5;
constexpr std::uint64_t kMostStates = lcm_io::kMaxDatagram / sizeof(double);

/// Whether lcm-gen's decoder may be let at the bytes: what it reads is there,
/// and all of it.
bool Sound(std::span<const std::uint8_t> encoded) {
  lcm_io::ByteReader bytes(encoded);
  std::uint64_t hash = 0, utime = 0, sequence = 0, n = 0;
  std::string text;
  const bool head = bytes.Read(8, &hash) &&
                    static_cast<std::int64_t>(hash) == wheel_response_t::getHash() &&
                    bytes.Read(8, &utime) && bytes.Read(8, &sequence) &&
                    bytes.ReadString(lcm_io::kMaxDatagram, &text) &&  // sender
                    bytes.ReadString(lcm_io::kMaxDatagram, &text) &&  // model
                    bytes.ReadString(lcm_io::kMaxDatagram, &text) &&  // error
                    bytes.Read(4, &n) && n <= kMostStates;
  // flags, slip, attack_angle
  if (!head || !bytes.Skip(n * (4 + 2 * sizeof(double)))) return false;
  for (std::size_t output = 0; output < kOutputs; ++output) {
    std::uint64_t own = 0;
    if (!bytes.Read(4, &own) || own != n) return false;
    if (!bytes.Skip(n * kArraysOfOutput * sizeof(double))) return false;
  }
  return bytes.left() == 0;
}

bool SoundMeasured(std::span<const std::uint8_t> encoded) {
  constexpr std::size_t kArrays = 3;
  lcm_io::ByteReader bytes(encoded);
  std::uint64_t hash = 0, utime = 0, sequence = 0, n = 0;
  std::string text;
  const bool head = bytes.Read(8, &hash) &&
                    static_cast<std::int64_t>(hash) == wheel_measured_t::getHash() &&
                    bytes.Read(8, &utime) && bytes.Read(8, &sequence) &&
                    bytes.ReadString(lcm_io::kMaxDatagram, &text) &&  // sender
                    bytes.ReadString(lcm_io::kMaxDatagram, &text) &&  // model
                    bytes.Read(4, &n) && n <= kMostStates;
  if (!head) return false;
  for (std::size_t output = 0; output < kOutputs; ++output) {
    std::uint64_t own = 0;
    if (!bytes.Read(4, &own) || (own != 0 && own != n)) return false;
    if (!bytes.Skip(own * kArrays * sizeof(double))) return false;
  }
  return bytes.left() == 0;
}

template <class Message>
bool Decode(std::span<const std::uint8_t> encoded, Message* out) {
  Message message;
  if (message.decode(encoded.data(), 0, static_cast<int>(encoded.size())) < 0) return false;
  *out = std::move(message);
  return true;
}

}  // namespace

bool DecodeResponse(std::span<const std::uint8_t> encoded, wheel_response_t* out) {
  return Sound(encoded) && Decode(encoded, out);
}

bool DecodeMeasured(std::span<const std::uint8_t> encoded, wheel_measured_t* out) {
  return SoundMeasured(encoded) && Decode(encoded, out);
}

}  // namespace grouser::client
