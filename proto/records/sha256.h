#pragma once

#include <string>
#include <string_view>

namespace grouser::records {

/// Lower-case hex SHA-256 of the bytes of a string, and of a file. The file
/// form throws std::runtime_error "PATH: cause" when it cannot be read.
std::string Sha256OfString(std::string_view bytes);
std::string Sha256OfFile(const std::string& path);

}  // namespace grouser::records
