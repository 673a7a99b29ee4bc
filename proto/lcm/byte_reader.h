#pragma once

#include <cstdint>
#include <cstring>
#include <span>
#include <string>

namespace grouser::lcm_io {

/// Reads LCM's big-endian encoding and never goes past the end. lcm-gen's
/// decoders trust the lengths that they read: what is decoded by them is walked
/// through with this first.
class ByteReader {
 public:
  explicit ByteReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  /// `width` bytes (1 to 8) as a number; false, and nothing read, without them.
  bool Read(std::size_t width, std::uint64_t* value) {
    if (left() < width) return false;
    *value = 0;
    for (std::size_t i = 0; i < width; ++i) *value = (*value << 8) | bytes_[at_++];
    return true;
  }
  /// A string of at most `most` bytes with its final NUL, the only one. Its
  /// length stands before it (4 bytes, NUL counted).
  bool ReadString(std::size_t most, std::string* text) {
    std::uint64_t length = 0;
    if (!Read(4, &length) || length < 1 || length > left() || length > most) return false;
    const auto* start = reinterpret_cast<const char*>(bytes_.data() + at_);
    if (std::memchr(start, '\0', length) != start + length - 1) return false;
    text->assign(start, length - 1);
    at_ += length;
    return true;
  }
  bool Skip(std::size_t count) {
    if (left() < count) return false;
    at_ += count;
    return true;
  }
  std::size_t left() const { return bytes_.size() - at_; }

 private:
  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;
};

}  // namespace grouser::lcm_io
