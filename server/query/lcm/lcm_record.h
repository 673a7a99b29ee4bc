#pragma once

#include "grouser/v1alpha1/terrain_service.pb.h"
#include "grouser_lcm/wheel_measured_t.hpp"
#include "grouser_lcm/wheel_query_t.hpp"
#include "grouser_lcm/wheel_response_t.hpp"

namespace grouser::server {

/// A query over LCM and its answer as the log of queries has them (query_log.proto).
struct LcmRecord {
  v1alpha1::EvaluateWheelsRequest request;
  v1alpha1::EvaluateWheelsResponse response;
};
/// Precondition: `response` answers `query`, without an error.
LcmRecord RecordOf(const grouser_lcm::wheel_query_t& query,
                   const grouser_lcm::wheel_response_t& response,
                   const grouser_lcm::wheel_measured_t& measured);

}  // namespace grouser::server
