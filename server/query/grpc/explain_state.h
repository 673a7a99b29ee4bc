#pragma once

#include "grouser/v1alpha1/terrain_service.pb.h"
#include "server/core/snapshot.h"

namespace grouser::server {

/// Why a model answers one state as it does (surrogate::Explain), by what is served. NOT_FOUND,
/// UNAVAILABLE and INVALID_ARGUMENT as Snapshot::Find and ValidateStates; INVALID_ARGUMENT for a
/// max_runs that is too large, RESOURCE_EXHAUSTED for more states than one.
Status ExplainState(const Snapshot& snapshot, const v1alpha1::ExplainRequest& request,
                    v1alpha1::ExplainResponse* response);

}  // namespace grouser::server
