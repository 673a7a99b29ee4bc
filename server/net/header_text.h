#pragma once

#include <algorithm>
#include <string_view>

namespace grouser::server {

/// Whether gRPC takes it as the value of a header: printable ASCII. It ends the program at
/// another one that is given to a client's context.
inline bool IsHeaderText(std::string_view value) {
  return std::ranges::all_of(value, [](char c) { return c >= 0x20 && c <= 0x7e; });
}

}  // namespace grouser::server
