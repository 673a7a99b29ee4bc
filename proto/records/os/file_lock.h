#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

#include "proto/records/os/regular_file.h"
#include "proto/records/os/unique_fd.h"

namespace grouser::os {

/// flock(2) on a lock file, made where missing. The lock belongs to the open
/// file: it lasts while any process holds a copy of the descriptor. A job's
/// worker gets its folder's lock as standard input, so the lock says whether
/// anything of the worker's process tree is alive, whoever has died above it.

/// An invalid descriptor where another holds it. The file is opened with `flags` as well, and made
/// with `mode`. Throws std::runtime_error where it cannot be made.
UniqueFd TryLock(const std::string& path, int flags = 0, mode_t mode = kEverybodys);

/// A process that is just being spawned holds a copy of every descriptor until
/// it executes: a lock that is free but for such a one comes free within this.
inline constexpr double kSpawnS = 0.5;

/// As TryLock, tried for `timeout_s`.
UniqueFd LockWithin(const std::string& path, double timeout_s, int flags = 0,
                    mode_t mode = kEverybodys);

/// Processes that have the file open (of those that /proc lets us see).
std::vector<pid_t> HoldersOf(const std::string& path);

/// Takes the lock; kills (SIGKILL) whoever else holds it. For locks that only
/// left-over workers can hold. Throws std::runtime_error naming the holders
/// where they outlive `timeout_s`.
UniqueFd LockEvicting(const std::string& path, double timeout_s);

}  // namespace grouser::os
