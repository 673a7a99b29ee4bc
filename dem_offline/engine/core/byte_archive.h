#pragma once

#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

// Plain data to bytes and back, to the bit, on one kind of machine. One function that calls an
// archive with every member does both: template <class Archive> void Walk(Archive& a) { a(x_); }

namespace grouser::dem {

class ByteWriter {
 public:
  template <class T>
  void operator()(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof(T));
  }
  template <class T>
  void operator()(const std::vector<T>& values) {
    static_assert(std::is_trivially_copyable_v<T>);
    (*this)(static_cast<std::uint64_t>(values.size()));
    bytes_.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
  }
  void operator()(const std::string& text) {
    (*this)(static_cast<std::uint64_t>(text.size()));
    bytes_ += text;
  }
  std::string& bytes() { return bytes_; }

 private:
  std::string bytes_;
};

/// Reads what a ByteWriter wrote. Throws std::invalid_argument beyond the end.
class ByteReader {
 public:
  explicit ByteReader(std::string bytes) : bytes_(std::move(bytes)) {}
  template <class T>
  void operator()(T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    std::memcpy(&value, Take(1, sizeof(T)), sizeof(T));
  }
  template <class T>
  void operator()(std::vector<T>& values) {
    static_assert(std::is_trivially_copyable_v<T>);
    std::uint64_t n = 0;
    (*this)(n);
    const char* from = Take(n, sizeof(T));
    values.resize(n);
    if (n > 0) std::memcpy(values.data(), from, n * sizeof(T));
  }
  void operator()(std::string& text) {
    std::uint64_t n = 0;
    (*this)(n);
    text.assign(Take(n, 1), n);
  }

 private:
  const char* Take(std::uint64_t n, std::size_t size) {
    if (n > (bytes_.size() - at_) / size) throw std::invalid_argument("checkpoint: cut short");
    const char* from = bytes_.data() + at_;
    at_ += n * size;
    return from;
  }

  std::string bytes_;
  std::size_t at_ = 0;
};

}  // namespace grouser::dem
