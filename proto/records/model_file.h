#pragma once

#include <string>

#include "grouser/v1alpha1/model.pb.h"

namespace grouser::records {

/// Model files: 16-byte header (magic "GROUSERMODEL\n", version), then the
/// length and the SHA-256 of the payload, then a serialised v1alpha1.Model.
/// No HDF5 here: the server links this target.

/// Writes aside, syncs, renames, syncs the folder. Returns the digest: the
/// lower-case hex SHA-256 of the payload. Throws std::runtime_error with path
/// and cause.
std::string WriteModelFile(const std::string& path, const v1alpha1::Model& model);

struct LoadedModel {
  v1alpha1::Model model;
  std::string digest;
};

/// Throws std::runtime_error "PATH: what is wrong, what was expected" for a
/// missing, truncated, corrupted or foreign file.
LoadedModel ReadModelFile(const std::string& path);

/// Writes any small text or binary file with the same guarantees.
void WriteFileDurably(const std::string& path, const std::string& bytes);

}  // namespace grouser::records
