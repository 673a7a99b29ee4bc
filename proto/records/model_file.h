#pragma once

#include <cstdint>
#include <string>

#include "grouser/v1alpha1/model.pb.h"

namespace grouser::records {

/// Model files: 16-byte header (magic "GROUSERMODEL\n", version), then the
/// length and the SHA-256 of the payload, then a serialised v1alpha1.Model.
/// No HDF5 here: the server links this target. Version 001 had bekker_values and
/// created_unix_s; surrogate::ReadModel reads both. Version 003 is 002 with a share of the table in
/// a hybrid's answer, which programs that know 002 alone would take for an addition to the physics;
/// it is written for such models, 002 for all others.
inline constexpr int kModelFileVersion = 3;  ///< the last that is read
int ModelFileVersionOf(const v1alpha1::Model& model);

/// Writes aside, syncs, renames, syncs the folder. Returns the digest: the
/// lower-case hex SHA-256 of the payload. Throws std::runtime_error with path
/// and cause.
std::string WriteModelFile(const std::string& path, const v1alpha1::Model& model);

/// The models of today have less than 1 MB.
inline constexpr std::uint64_t kMaxModelFileBytes = std::uint64_t{256} << 20;

struct LoadedModel {
  v1alpha1::Model model;
  std::string digest;
  int version = kModelFileVersion;
};

/// The message as the file holds it, of any version (surrogate::ReadModel gives
/// it in today's form). Throws std::runtime_error "PATH: what is wrong, what was expected"
/// for a missing, truncated, corrupted or foreign file, one of more than
/// kMaxModelFileBytes, and what is no regular file. Never waits.
LoadedModel ReadModelFile(const std::string& path);

/// Seconds since 1970 as files of earlier versions hold them. Throws std::invalid_argument
/// beyond the years 1970 to 9999.
google::protobuf::Timestamp TimestampOf(double unix_s);

/// That of the file that WriteModelFile would write: equal for equal models.
std::string DigestOf(const v1alpha1::Model& model);

/// Writes any small text or binary file with the same guarantees. Throws os::NoSpace where there is
/// none.
void WriteFileDurably(const std::string& path, const std::string& bytes);

}  // namespace grouser::records
