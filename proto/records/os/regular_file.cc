#include "proto/records/os/regular_file.h"

#include <fcntl.h>
#include <stdio.h>
#include <sys/stat.h>

#include <cerrno>
#include <stdexcept>

#include "proto/records/os/no_space.h"

namespace grouser::os {

UniqueFd OpenRegular(const std::string& path, int flags, mode_t mode) {
  // O_NONBLOCK: opening a FIFO would wait for its other end. O_TRUNC has no
  // effect on what is refused below.
  UniqueFd fd(::open(path.c_str(), flags | O_CLOEXEC | O_NONBLOCK | O_NOCTTY, mode));
  if (!fd.valid()) ThrowErrno(path, "cannot be opened");
  struct stat info {};
  if (::fstat(fd.get(), &info) != 0) ThrowErrno(path, "cannot be looked at");
  if (!S_ISREG(info.st_mode)) {
    throw std::runtime_error(path + ": expected a regular file, got something else");
  }
  return fd;
}

std::string SetAside(const std::string& path) {
  for (int attempt = 1; attempt < 1000; ++attempt) {
    const std::string aside =
        path + ".damaged" + (attempt == 1 ? "" : "-" + std::to_string(attempt));
    if (::renameat2(AT_FDCWD, path.c_str(), AT_FDCWD, aside.c_str(), RENAME_NOREPLACE) == 0) {
      return aside;
    }
    if (errno != EEXIST) break;
  }
  ThrowErrno(path, "cannot be set aside");
}

}  // namespace grouser::os
