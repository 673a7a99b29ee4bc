#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "grouser_lcm/wheel_measured_t.hpp"
#include "grouser_lcm/wheel_query_t.hpp"
#include "grouser_lcm/wheel_response_t.hpp"
#include "server/core/snapshot.h"

namespace grouser::server {

inline constexpr const char* kLcmQueryChannel = "GROUSER_QUERY";
inline constexpr const char* kLcmResponseChannel = "GROUSER_RESPONSE";
inline constexpr const char* kLcmMeasuredChannel = "GROUSER_MEASURED";
/// Most states in one LCM message: liblcm 1.3.1 loses messages over 65,499 B.
inline constexpr int kMaxLcmStates = 64;

/// How a query over LCM ended, for those who count them.
struct LcmOutcome {
  StatusCode code = StatusCode::kInvalidArgument;
  const ServedModel* model = nullptr;  ///< that answered, of the snapshot
  grouser_lcm::wheel_query_t query{};  ///< that it answered
};

/// Answers one encoded wheel_query_t. A query that cannot be answered (too many
/// states, unknown model) gets a response whose `error` says why. Bytes that
/// are no wheel_query_t get no response: `problem` then says why. Checks every
/// length before decoding, since lcm-gen's decoder trusts them. measured: sd_form and the intervals
/// for a measurement; n 0 where the model knows none.
std::optional<grouser_lcm::wheel_response_t> AnswerLcm(const Snapshot& snapshot,
                                                       std::span<const std::uint8_t> encoded,
                                                       std::string* problem,
                                                       grouser_lcm::wheel_measured_t* measured,
                                                       LcmOutcome* outcome = nullptr);

}  // namespace grouser::server
