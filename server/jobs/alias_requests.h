#pragma once

#include <string>

#include "grouser/v1alpha1/jobs_service.pb.h"
#include "server/core/repository.h"
#include "server/core/status.h"

namespace grouser::server {

inline constexpr int kMaxMovesPageSize = 1000;

/// What is recorded of who moved an alias: the caller as AccessPolicy knows it, then what the
/// request calls itself.
std::string WhoOf(const std::string& caller, const std::string& says);

/// How a request ends whose alias could not be moved: RESOURCE_EXHAUSTED where there was no space.
StatusCode NotMovedCode(const std::exception& e);

/// Requests about aliases alone, without a job. `who`: the caller, as AccessPolicy knows it. All
/// throw StatusError naming the field.

/// To what an alias but "candidate" names or named, or what is shipped. To "stable" only
/// what was fitted from the present one, or was it before. override_gate lifts both.
v1alpha1::MoveAliasResponse MoveAlias(Repository& repository,
                                      const v1alpha1::MoveAliasRequest& request,
                                      const std::string& who);
v1alpha1::MoveAliasResponse RollbackAlias(Repository& repository,
                                          const v1alpha1::RollbackAliasRequest& request,
                                          const std::string& who);
v1alpha1::ListAliasMovesResponse ListAliasMoves(const Repository& repository,
                                                const v1alpha1::ListAliasMovesRequest& request);

}  // namespace grouser::server
