#pragma once

#include "grouser/v1alpha1/terrain_service.pb.h"
#include "server/core/query_metrics.h"
#include "server/core/snapshot_store.h"

namespace grouser::server {

/// Answers one request from the current snapshot. The reused `response` is
/// overwritten; on failure its error field says why as well, in band. `metrics` counts it.
Status Answer(const SnapshotStore& store, QueryMetrics& metrics, Transport transport,
              const v1alpha1::EvaluateWheelsRequest& request,
              v1alpha1::EvaluateWheelsResponse* response);

}  // namespace grouser::server
