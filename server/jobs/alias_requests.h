#pragma once

#include <string>

#include "grouser/v1alpha1/jobs_service.pb.h"
#include "server/core/repository.h"

namespace grouser::server {

inline constexpr int kMaxMovesPageSize = 1000;

/// Requests about aliases alone, without a job. `peer` is named as who where the request
/// names nobody. All throw StatusError naming the field.

/// To what an alias but "candidate" names or named, or what is shipped. To "stable" only
/// what was fitted from the present one, or was it before. override_gate lifts both.
v1alpha1::MoveAliasResponse MoveAlias(Repository& repository,
                                      const v1alpha1::MoveAliasRequest& request,
                                      const std::string& peer);
v1alpha1::MoveAliasResponse RollbackAlias(Repository& repository,
                                          const v1alpha1::RollbackAliasRequest& request,
                                          const std::string& peer);
v1alpha1::ListAliasMovesResponse ListAliasMoves(const Repository& repository,
                                                const v1alpha1::ListAliasMovesRequest& request);

}  // namespace grouser::server
