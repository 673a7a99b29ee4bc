#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "grouser/v1alpha1/jobs_service.pb.h"

namespace grouser::server {

/// Limits on what a request may say.
inline constexpr std::size_t kMaxRequestIdCharacters = 128;
inline constexpr double kMaxTimeS = 600.0;  ///< simulated; longer is a slip of the pen
inline constexpr int kMaxJobsPageSize = 500;
inline constexpr int kMostPriority = 10;  ///< and its negative the least

/// All throw StatusError(kInvalidArgument) naming the field, its value and
/// what was expected. What needs the model (does it exist, can it be refined)
/// is judged elsewhere.
void CheckSubmit(const v1alpha1::SubmitRefinementRequest& request);
/// What all kinds of jobs have. `time_limit`: null where there is none.
void CheckEnvelope(const std::string& request_id, int priority,
                   const google::protobuf::Duration* time_limit);
void CheckTestState(const v1alpha1::TestState& state);
void CheckCancel(const v1alpha1::CancelJobRequest& request);
void CheckPromote(const v1alpha1::PromoteRequest& request);
void CheckPrune(const v1alpha1::PruneRequest& request);
/// One that people move: not previous, not candidate.
void CheckMovableAlias(const std::string& alias);
void CheckWhoAndWhy(const std::string& who, const std::string& why);
void CheckJobId(const std::string& job_id);

/// The state with the default mode named, fields that the mode ignores zeroed
/// and no negative zeros, so that equal work has equal messages.
v1alpha1::TestState Canonical(const v1alpha1::TestState& state);

/// SHA-256 of a message, equal for equal messages.
std::string HashOf(const google::protobuf::Message& message);

/// Hash of what a submission asks for, its request_id aside.
template <class Request>
std::string ContentOf(Request request) {
  request.clear_request_id();
  return HashOf(request);
}

}  // namespace grouser::server
