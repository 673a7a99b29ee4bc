#pragma once

#include <iterator>
#include <string>

namespace grouser::records {

/// The codes of gRPC and google.rpc.Status by number.
inline constexpr const char* kStatusCodeNames[] = {
    "OK",        "CANCELLED",      "UNKNOWN",           "INVALID_ARGUMENT",   "DEADLINE_EXCEEDED",
    "NOT_FOUND", "ALREADY_EXISTS", "PERMISSION_DENIED", "RESOURCE_EXHAUSTED", "FAILED_PRECONDITION",
    "ABORTED",   "OUT_OF_RANGE",   "UNIMPLEMENTED",     "INTERNAL",           "UNAVAILABLE",
    "DATA_LOSS", "UNAUTHENTICATED"};

/// "INVALID_ARGUMENT" and so on; the number for an unknown one.
inline std::string StatusCodeName(int code) {
  if (code < 0 || code >= std::ssize(kStatusCodeNames)) return std::to_string(code);
  return kStatusCodeNames[code];
}

}  // namespace grouser::records
