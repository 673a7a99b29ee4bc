#pragma once

#include <sys/types.h>

#include <string>

#include "proto/records/os/unique_fd.h"

namespace grouser::os {

/// What files are made with; the umask takes from it.
inline constexpr mode_t kEverybodys = 0666, kOwnersAlone = 0600;

/// open(2) of a regular file, with O_CLOEXEC added. Never waits: a FIFO, socket,
/// device or folder of that name is refused. Throws std::runtime_error "PATH: cause"; NoSpace where
/// there is none.
UniqueFd OpenRegular(const std::string& path, int flags, mode_t mode = kEverybodys);

/// Renames what is in the way (a damaged file, a folder or FIFO of a file's
/// name) to PATH.damaged, or PATH.damaged-2 and so on where that is taken:
/// nothing is deleted. Returns the new name. Throws std::runtime_error.
std::string SetAside(const std::string& path);

}  // namespace grouser::os
