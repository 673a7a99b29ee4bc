#include "server/jobs/job_state.h"

namespace grouser::server {

using namespace v1alpha1;  // NOLINT: the enumerators below are all of one enum

bool HasEnded(JobState state) {
  return state == JOB_STATE_DONE || state == JOB_STATE_FAILED || state == JOB_STATE_CANCELLED;
}

bool IsWorking(JobState state) {
  return state == JOB_STATE_RUNNING || state == JOB_STATE_FITTING || state == JOB_STATE_VALIDATING;
}

bool MayMove(JobState from, JobState to) {
  if (HasEnded(from) || from == JOB_STATE_UNSPECIFIED) return false;
  if (to == JOB_STATE_FAILED || to == JOB_STATE_CANCELLED) return true;
  switch (to) {
    case JOB_STATE_QUEUED:
      return IsWorking(from) || from == JOB_STATE_AWAITING_PROMOTION;
    case JOB_STATE_RUNNING:
      return from == JOB_STATE_QUEUED;
    case JOB_STATE_FITTING:
      return from == JOB_STATE_RUNNING;
    case JOB_STATE_VALIDATING:
      return from == JOB_STATE_FITTING;
    case JOB_STATE_AWAITING_PROMOTION:
      return from == JOB_STATE_VALIDATING;
    case JOB_STATE_DONE:
      return from == JOB_STATE_AWAITING_PROMOTION || from == JOB_STATE_RUNNING ||
             from == JOB_STATE_FITTING;
    default:
      return false;
  }
}

}  // namespace grouser::server
