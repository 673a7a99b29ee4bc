#pragma once

#include <string>
#include <vector>

namespace grouser::bench {

struct JobOptions {
  std::string program;  ///< grouser-server; empty: beside this program
  double seconds = 60;  ///< of the stream, for each of the means; as long for the echo
  unsigned seed = 1;    ///< of the random states
};

/// A way to keep a job from disturbing queries.
struct JobRow {
  std::string means;
  std::size_t samples = 0;           ///< of the server
  double share = 0, echo_share = 0;  ///< of the round trips that take over 1 ms
  double p99_us = 0, echo_p99_us = 0;
  double target = -1;  ///< share at most; negative: none
  bool met() const { return share <= target; }
};

struct JobResult {
  std::string job;  ///< what ran beside
  int states = 4;   ///< of a message
  std::vector<JobRow> rows;
};

/// Streams at 1 kHz to a server and to an echo, by turns of a second, while a DEM run, or a
/// spinning program where none is built, works on the same machine as a refinement's worker does.
/// Throws ClientError or std::runtime_error.
JobResult MeasureWithJob(const JobOptions& options);

}  // namespace grouser::bench
