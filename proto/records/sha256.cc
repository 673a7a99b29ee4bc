#include "proto/records/sha256.h"

#include <openssl/evp.h>

#include <array>
#include <stdexcept>

#include "proto/records/durable_file.h"

namespace grouser::records {

std::string Sha256OfString(std::string_view bytes) {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned int size = 0;
  if (EVP_Digest(bytes.data(), bytes.size(), digest.data(), &size, EVP_sha256(), nullptr) != 1) {
    throw std::runtime_error("SHA-256 failed in OpenSSL");
  }
  static constexpr char kHex[] = "0123456789abcdef";
  std::string hex;
  hex.reserve(2 * size);
  for (unsigned int i = 0; i < size; ++i) {
    hex += kHex[digest[i] >> 4];
    hex += kHex[digest[i] & 15];
  }
  return hex;
}

std::string Sha256OfFile(const std::string& path) { return Sha256OfString(ReadFileBytes(path)); }

}  // namespace grouser::records
