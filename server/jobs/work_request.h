#pragma once

#include <string>

#include "grouser/v1alpha1/jobs_service.pb.h"

namespace grouser::server {

/// Work is what a job does that is no refinement: a campaign or a calibration, run by one program
/// from files that the client sends.

inline constexpr int kMostFiles = 64;
inline constexpr std::size_t kMostFileBytes = 1 << 20;  ///< of all of a request
inline constexpr std::size_t kMostFileName = 200;       ///< characters
inline constexpr int kMostFolders = 4;                  ///< that a file may lie in, one in another
inline constexpr double kMostBudgetHours = 1000;
inline constexpr std::uint32_t kMostPoints = 1000;

/// A request for work, whichever it is.
struct WorkRequest {
  std::string request_id, content;  ///< as JobBook::Submit takes them
  v1alpha1::Job job;                ///< work, priority, time_limit
  google::protobuf::RepeatedPtrField<v1alpha1::NamedFile> files;
};
WorkRequest WorkOf(const v1alpha1::SubmitCampaignRequest& request);
WorkRequest WorkOf(const v1alpha1::SubmitCalibrationRequest& request);

/// A job that is no refinement.
bool HasWork(const v1alpha1::Job& job);

/// What can be said without a look into the files. Throws StatusError(kInvalidArgument) naming the
/// field, its value and what was expected.
void CheckWork(const WorkRequest& request);

/// Equal for requests that are the same work under the same time limit.
std::string JoinKeyOf(const WorkRequest& request);

}  // namespace grouser::server
