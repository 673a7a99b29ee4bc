#pragma once

#include <string>

#include "grouser/v1alpha1/terrain_service.pb.h"

namespace grouser::bench {

struct EchoOptions {
  std::string answers;    ///< folder of the answers that SaveAnswer() and SaveLcmAnswer() wrote
  std::string grpc;       ///< HOST:PORT or unix:PATH
  std::string port_file;  ///< receives "grpc=ADDR"
  std::string lcm_url;    ///< empty: no LCM
  std::string lcm_interface = "lo";
};

/// What no server can be faster than, with these messages in this build: reads each query of
/// TerrainService (EvaluateWheels, StreamWheels) and LCM, and sends the answer that was saved for
/// as many states. Ends with SIGTERM. Throws std::runtime_error.
void RunEcho(const EchoOptions& options);

/// Files of an answer in `folder`, found again by the query's number of states and whether it names
/// fields.
std::string AnswerPath(const std::string& folder, const v1alpha1::EvaluateWheelsRequest& request);
std::string LcmAnswerPath(const std::string& folder, int states);
std::string LcmMeasuredPath(const std::string& folder, int states);

}  // namespace grouser::bench
