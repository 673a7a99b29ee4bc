#pragma once

#include "grouser/v1alpha1/jobs_service.pb.h"
#include "proto/records/message_json.h"

namespace grouser::server {

/// The job state machine. Work goes QUEUED -> RUNNING -> FITTING -> VALIDATING
/// -> AWAITING_PROMOTION -> DONE; a requeue (retry, restart) leads from the
/// three working states back to QUEUED, and so does a refit after stable has moved from
/// AWAITING_PROMOTION; a refinement whose run its model has already goes from FITTING to DONE,
/// campaigns and calibrations from RUNNING; FAILED and CANCELLED end any open one.
bool MayMove(v1alpha1::JobState from, v1alpha1::JobState to);

/// Nothing more will change: DONE, FAILED, CANCELLED.
bool HasEnded(v1alpha1::JobState state);

/// A worker process may be at it: RUNNING, FITTING, VALIDATING.
bool IsWorking(v1alpha1::JobState state);

using records::ShortName;

}  // namespace grouser::server
