#pragma once

#include <string>
#include <vector>

#include "server/core/repository.h"

namespace grouser::server {

/// What an alias named, oldest first, and names now; what a rollback left is not in it.
std::vector<std::string> NamedInTurn(const Repository::Aliases& aliases, const std::string& model,
                                     const std::string& alias);

/// The digest that a rollback to `to` (see Repository::Rollback) leads to. Throws
/// std::out_of_range naming what the alias named before where there is none.
std::string RollbackTarget(const Repository::Aliases& aliases, const std::string& model,
                           const std::string& alias, const std::string& to);

/// Drops all but the latest kMovesKept moves of each alias.
void BoundHistory(std::vector<AliasMove>* history);

/// Of each alias but "candidate": digests that its latest `most` moves led from and to, and those
/// that its next `most` rollbacks lead to.
std::vector<std::string> NamedLately(const Repository::Aliases& aliases, std::size_t most);

}  // namespace grouser::server
