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

/// Digests that the latest `most` moves of each alias but "candidate" led from and to.
std::vector<std::string> NamedLately(const Repository::Aliases& aliases, std::size_t most);

}  // namespace grouser::server
