#pragma once

#include <string>

#include "server/core/repository.h"

namespace grouser::server {

/// The alias file: JSON {"generation", "aliases": {model: {alias: digest}},
/// "history": [{model, alias, digest, from, rollback, generation, who, why, unix_s}]}.
/// Files of before 0.2 have no "from" and no "rollback": the former is then the digest of the
/// move before; of a "stable" that moved once what "previous" names.

/// Reads it; a missing file is generation 0 without aliases. Throws
/// std::runtime_error "PATH: what is wrong, what was expected".
Repository::Aliases ReadAliasFile(const std::string& path);

/// Writes it durably (aside, synced, renamed). Throws std::runtime_error.
void WriteAliasFile(const std::string& path, const Repository::Aliases& aliases);

}  // namespace grouser::server
