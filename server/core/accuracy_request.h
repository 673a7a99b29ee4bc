#pragma once

#include "grouser/v1alpha1/run.pb.h"
#include "grouser/v1alpha1/state.pb.h"
#include "server/core/status.h"
#include "surrogate/models/accuracy_request.h"

namespace grouser::server {

/// The evaluator's form of a message's accuracy request. INVALID_ARGUMENT naming the field
/// that is negative or not finite, or the target of a tolerance that is not there; *accuracy is
/// then empty.
Status ReadAccuracyRequest(const v1alpha1::AccuracyRequest& message,
                           surrogate::AccuracyRequest* accuracy);

/// The wheel test of a state, mirrored to v_x, v_y >= 0 where campaigns run:
/// models have these symmetries, so that it teaches them the state itself.
/// Precondition: finite, not at rest.
v1alpha1::TestState ToTestState(double v_x, double v_y, double rim_speed, double load);

}  // namespace grouser::server
