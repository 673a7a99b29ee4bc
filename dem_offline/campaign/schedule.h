#pragma once

#include <vector>

#include "grouser/v1alpha1/campaign.pb.h"

namespace grouser::campaign {

/// Order in which to run (indices into campaign.runs()): training runs and the
/// others each by expected length, longest first, so that no long run is left
/// alone on one core at the end; held-out and patch runs are spread over the
/// first two thirds of the training runs.
std::vector<int> ScheduleOrder(const v1alpha1::Campaign& campaign);

/// Expected length of a run, in arbitrary units. Runs stop when their standard
/// error is met, so the noisy ones are long: large slip, large attack angle
/// (the wheel bulldozes), low load (the target is relative to the load). Only an
/// order; nothing depends on its numbers.
double ExpectedLength(const v1alpha1::TestState& state);

}  // namespace grouser::campaign
