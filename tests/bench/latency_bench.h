#pragma once

#include <string>
#include <vector>

namespace grouser::bench {

struct LatencyOptions {
  std::string server = "127.0.0.1:50151";
  std::string model;    ///< empty: the only one
  std::string lcm_url;  ///< empty: liblcm's default
  std::string lcm_interface = "lo";
  bool lcm = true;
  double seconds = 10;  ///< about how long to measure
  unsigned seed = 1;    ///< of the random states
};

/// Round trips of one transport at one batch size, one message in flight, back
/// to back.
struct LatencyRow {
  std::string transport;  ///< "grpc_unary", "grpc_stream", "lcm"
  int batch = 0;          ///< states in a message
  std::size_t samples = 0;
  std::size_t lost = 0;  ///< LCM messages without an answer
  double p50_us = 0, p99_us = 0;
  double states_per_s = 0;  ///< batch over the mean round trip
};

/// Measures every transport and batch size, interleaved, so that a disturbance
/// hits all alike. Throws ClientError or std::runtime_error.
std::vector<LatencyRow> MeasureLatency(const LatencyOptions& options);

/// Nearest-rank quantile of sorted values.
double Quantile(const std::vector<double>& sorted, double q);

}  // namespace grouser::bench
