#pragma once

#include <string>

#include "proto/records/model_file.h"

namespace grouser::records {

/// What ReadModelFile makes of the bytes of `path`, read by whoever calls. Throws
/// std::runtime_error "PATH: what is wrong, what was expected": that is the bytes' own fault.
LoadedModel ModelFromBytes(const std::string& bytes, const std::string& path);

}  // namespace grouser::records
