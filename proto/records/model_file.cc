#include "proto/records/model_file.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>

#include <cmath>
#include <cstdint>
#include <stdexcept>

#include "proto/records/durable_file.h"
#include "proto/records/model_bytes.h"
#include "proto/records/sha256.h"

namespace grouser::records {
namespace {

// Layout: magic (13 bytes), version (3 digits), payload length (8 bytes, little
// endian), SHA-256 of the payload (64 hex digits), payload.
constexpr char kMagic[] = "GROUSERMODEL\n";
constexpr std::size_t kMagicSize = 13, kVersionSize = 3, kLengthSize = 8, kDigestSize = 64;
constexpr std::size_t kHeaderSize = kMagicSize + kVersionSize + kLengthSize + kDigestSize;

std::string VersionText(int version) { return "00" + std::to_string(version); }

std::string LengthBytes(std::uint64_t length) {
  std::string bytes;
  for (int i = 0; i < 8; ++i) bytes += static_cast<char>((length >> (8 * i)) & 0xff);
  return bytes;
}

std::uint64_t LengthOf(const std::string& bytes, std::size_t offset) {
  std::uint64_t length = 0;
  for (int i = 7; i >= 0; --i) {
    length = length << 8 | static_cast<unsigned char>(bytes[offset + static_cast<std::size_t>(i)]);
  }
  return length;
}

// Maps are sorted, so that equal models have equal digests.
std::string SerializeDeterministically(const v1alpha1::Model& model) {
  std::string payload;
  google::protobuf::io::StringOutputStream stream(&payload);
  google::protobuf::io::CodedOutputStream coded(&stream);
  coded.SetSerializationDeterministic(true);
  if (!model.SerializeToCodedStream(&coded)) throw std::runtime_error("model cannot be serialised");
  coded.Trim();
  return payload;
}

}  // namespace

int ModelFileVersionOf(const v1alpha1::Model& model) {
  constexpr int kShareChannel = 2;  // f_z's: surrogate/models/residual_table.h
  const bool hybrid = model.kind() == v1alpha1::MODEL_KIND_HYBRID ||
                      model.kind() == v1alpha1::MODEL_KIND_UNSPECIFIED;
  const v1alpha1::ResidualTable& table = model.residual();
  const bool share = hybrid && table.coefficients_size() > kShareChannel &&
                     table.coefficients(kShareChannel).values_size() > 0;
  return share ? 3 : 2;
}

std::string DigestOf(const v1alpha1::Model& model) {
  return Sha256OfString(SerializeDeterministically(model));
}

std::string WriteModelFile(const std::string& path, const v1alpha1::Model& model) {
  const std::string payload = SerializeDeterministically(model);
  const std::string digest = Sha256OfString(payload);
  WriteFileDurably(path, kMagic + VersionText(ModelFileVersionOf(model)) +
                             LengthBytes(payload.size()) + digest + payload);
  return digest;
}

LoadedModel ReadModelFile(const std::string& path) {
  return ModelFromBytes(ReadFileBytes(path, kMaxModelFileBytes), path);
}

LoadedModel ModelFromBytes(const std::string& bytes, const std::string& path) {
  const auto fail = [&path](const std::string& what) {
    throw std::runtime_error(path + ": " + what);
  };
  if (bytes.compare(0, kMagicSize, kMagic) != 0) {
    fail("not a Grouser model file (expected it to start with GROUSERMODEL)");
  }
  LoadedModel loaded;
  const std::string version = bytes.substr(kMagicSize, kVersionSize);
  while (loaded.version > 0 && version != VersionText(loaded.version)) --loaded.version;
  if (loaded.version == 0) {
    fail("model file of version '" + version + "', expected one up to '" +
         VersionText(kModelFileVersion) + "'");
  }
  if (bytes.size() < kHeaderSize) fail("truncated model file (the header is incomplete)");
  const std::uint64_t length = LengthOf(bytes, kMagicSize + kVersionSize);
  const std::uint64_t have = bytes.size() - kHeaderSize;
  if (have != length) {
    fail("truncated or extended model file: " + std::to_string(have) +
         " bytes of payload, expected " + std::to_string(length));
  }
  const std::string payload = bytes.substr(kHeaderSize);
  loaded.digest = Sha256OfString(payload);
  const std::string stored = bytes.substr(kHeaderSize - kDigestSize, kDigestSize);
  if (loaded.digest != stored) {
    fail("corrupted model file: SHA-256 of the payload is " + loaded.digest + ", expected " +
         stored);
  }
  if (!loaded.model.ParseFromString(payload)) fail("payload is not a grouser.v1alpha1.Model");
  return loaded;
}

google::protobuf::Timestamp TimestampOf(double unix_s) {
  constexpr double kEndOf9999 = 253402300800.0;
  if (!(unix_s >= 0 && unix_s < kEndOf9999)) {
    throw std::invalid_argument("created_unix_s: " + std::to_string(unix_s) +
                                ", expected seconds since 1970, before the year 10000");
  }
  google::protobuf::Timestamp time;
  time.set_seconds(static_cast<std::int64_t>(unix_s));
  time.set_nanos(static_cast<std::int32_t>((unix_s - std::floor(unix_s)) * 1e9));
  return time;
}

}  // namespace grouser::records
