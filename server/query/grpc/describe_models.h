#pragma once

#include "grouser/v1alpha1/terrain_service.pb.h"
#include "server/core/snapshot.h"

namespace grouser::server {

inline constexpr int kMaxModelsPageSize = 1000;

/// One page of the snapshot's models with their aliases. The token names the last model of the
/// page before, so that models which come or go meanwhile move no other. INVALID_ARGUMENT for
/// a negative size or a token that no page gave.
Status ListModels(const Snapshot& snapshot, const v1alpha1::ListModelsRequest& request,
                  v1alpha1::ListModelsResponse* response);

/// One model with its error table and its provenance, without stress profiles.
Status GetModel(const Snapshot& snapshot, const v1alpha1::GetModelRequest& request,
                v1alpha1::GetModelResponse* response);

}  // namespace grouser::server
