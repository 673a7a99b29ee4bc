#pragma once

#include "grouser/v1alpha1/terrain_service.pb.h"
#include "server/core/query_metrics.h"
#include "server/core/snapshot_store.h"
#include "server/query/log/query_log.h"

namespace grouser::server {

/// Who answers queries, and is told of them. All must outlive it.
struct QueryPath {
  const SnapshotStore& store;
  QueryMetrics& metrics;
  QueryLog* log = nullptr;  ///< null: none
};

/// Answers one request from the current snapshot. The reused `response` is
/// overwritten; on failure its error field says why as well, in band. The path's metrics count it,
/// its log gets what was answered.
Status Answer(const QueryPath& path, Transport transport,
              const v1alpha1::EvaluateWheelsRequest& request,
              v1alpha1::EvaluateWheelsResponse* response);

/// The same by one snapshot, told to nobody and without a latency. *model: that was named; null on
/// failure.
Status AnswerFrom(const Snapshot& snapshot, const v1alpha1::EvaluateWheelsRequest& request,
                  v1alpha1::EvaluateWheelsResponse* response, const ServedModel** model);

}  // namespace grouser::server
