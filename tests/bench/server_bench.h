#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "grouser/v1alpha1/terrain_service.pb.h"
#include "tests/bench/child_program.h"

namespace grouser::bench {

struct ServerOptions {
  std::string program;  ///< grouser-server; empty: beside this program
  std::string lcm_interface = "lo";
  bool lcm = true;
  double seconds = 60;  ///< about how long to measure
  int starts = 5;       ///< of programs, for the first message
  unsigned seed = 1;    ///< of the random states
  /// Instead of an echo the server itself; the one that is measured logs its queries. No LCM, no
  /// targets and no first message then.
  bool query_log = false;
};

/// A quantile of the server's round trips beside the echo's, or those of a server without a log.
struct LatencyRatio {
  double server_us = 0, echo_us = 0;
  double ratio = 0;
  double least = 0, most = 0;  ///< by fifths of the measurement
  double target = 0;           ///< at most; 0: none
  bool met() const { return ratio <= target; }
};

/// Round trips of one message, one in flight, back to back.
struct ServerRow {
  std::string transport;  ///< "tcp unary", "tcp stream", "unix unary", "unix stream", "lcm"
  int states = 0;
  std::string fields;            ///< that are asked for; "all"
  std::size_t answer_bytes = 0;  ///< of gRPC
  std::size_t samples = 0;       ///< of the server
  std::size_t lost = 0;          ///< LCM messages without an answer, of both
  LatencyRatio p50, p99;
};

/// The first message of 10,000 states to a program that just started, on a connection that has
/// answered one state, over the median of such messages. Medians over the starts.
struct FirstMessage {
  double server_us = 0, echo_us = 0;
  double in_server_us = 0;  ///< as the server says
  double ratio = 0, least = 0, most = 0, echo_ratio = 0;
  double target = 3;
  bool met() const { return ratio <= target; }
};

struct ServerResult {
  std::vector<ServerRow> rows;
  FirstMessage first;
  bool query_log = false;  ///< as of the options
};

/// Starts grouser-server and an echo of the same answers, on TCP, a Unix socket and LCM, and
/// measures all of them, interleaved call by call, so that a disturbance hits all alike. Throws
/// ClientError or std::runtime_error.
ServerResult MeasureServer(const ServerOptions& options);

/// Random states inside the domain of the shipped model of a server; `fields` as of the request.
v1alpha1::EvaluateWheelsRequest RandomRequest(const std::string& server, int states, unsigned seed,
                                              const std::vector<std::string>& fields = {});

/// Saves the answer of a server for an echo. Returns its bytes.
std::size_t SaveAnswer(const std::string& server, const v1alpha1::EvaluateWheelsRequest& request,
                       const std::string& folder);

/// The words of an echo of the saved answers.
std::vector<std::string> EchoWords(const std::string& answers);

/// Nearest-rank quantile of sorted values.
double Quantile(const std::vector<double>& sorted, double q);

}  // namespace grouser::bench
