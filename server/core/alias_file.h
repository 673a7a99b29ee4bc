#pragma once

#include <string>

#include "server/core/repository.h"

namespace grouser::server {

/// The alias file: JSON {"generation", "aliases": {model: {alias: digest}},
/// "history": [{model, alias, digest, generation, who, why, unix_s}]}.

/// Reads it; a missing file is generation 0 without aliases. Throws
/// std::runtime_error "PATH: what is wrong, what was expected".
Repository::Aliases ReadAliasFile(const std::string& path);

/// Writes it durably (aside, synced, renamed). Throws std::runtime_error.
void WriteAliasFile(const std::string& path, const Repository::Aliases& aliases);

/// Exclusive advisory lock (flock) on `path`, created if missing; held until
/// destruction, released by the kernel when the process dies.
class FileLock {
 public:
  explicit FileLock(const std::string& path);
  ~FileLock();
  FileLock(const FileLock&) = delete;
  FileLock& operator=(const FileLock&) = delete;

 private:
  int fd_ = -1;
};

}  // namespace grouser::server
