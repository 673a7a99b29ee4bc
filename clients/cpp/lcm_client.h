#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "clients/cpp/channel.h"
#include "grouser_lcm/wheel_measured_t.hpp"
#include "grouser_lcm/wheel_query_t.hpp"
#include "grouser_lcm/wheel_response_t.hpp"

namespace grouser::client {

/// Wheel queries over LCM, one at a time. Not thread-safe.
class LcmClient {
 public:
  /// Empty `url`: $LCM_DEFAULT_URL, else liblcm's default. Answers are received
  /// on `interface` alone ("lo": from this machine). Throws std::runtime_error
  /// "lcm: ..." when LCM cannot be used here.
  explicit LcmClient(const std::string& url, const std::string& interface = "lo");
  ~LcmClient();
  LcmClient(const LcmClient&) = delete;
  LcmClient& operator=(const LcmClient&) = delete;

  /// Publishes `query` (its utime, sequence and sender are set here) and waits
  /// for its answer. LCM may lose messages: nothing within `timeout` when it
  /// did, or when no server listens. Throws std::runtime_error when the server
  /// answers with an error. measured: may be null; what the server said of measurements, n 0
  /// where it knows nothing (or LCM lost it).
  std::optional<grouser_lcm::wheel_response_t> Query(
      grouser_lcm::wheel_query_t* query, Milliseconds timeout,
      grouser_lcm::wheel_measured_t* measured = nullptr);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace grouser::client
