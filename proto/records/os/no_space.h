#pragma once

#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <string>

namespace grouser::os {

/// The disk or a quota is full: what failed may succeed when there is space again.
struct NoSpace : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Throws std::runtime_error "PATH: WHAT: cause"; NoSpace where that is the cause.
[[noreturn]] inline void ThrowErrno(const std::string& path, const std::string& what,
                                    int error = errno) {
  const std::string text = path + ": " + what + ": " + std::strerror(error);
  if (error == ENOSPC || error == EDQUOT) throw NoSpace(text);
  throw std::runtime_error(text);
}

}  // namespace grouser::os
