#pragma once

#include <string>

namespace grouser::records {

// WriteFileDurably stands in model_file.h.

/// Ending of the temporary file that WriteFileDurably writes aside. A killed
/// writer may leave one behind; nothing ever reads it.
inline constexpr char kTemporarySuffix[] = ".tmp";

/// All bytes of a regular file. Throws std::runtime_error "PATH: cause" for a
/// missing or unreadable one.
std::string ReadFileBytes(const std::string& path);

}  // namespace grouser::records
