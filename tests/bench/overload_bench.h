#pragma once

#include <string>
#include <vector>

namespace grouser::bench {

struct OverloadOptions {
  std::string program;                      ///< grouser-server; empty: beside this program
  std::vector<std::string> server_options;  ///< more options for it
  int connections = 64;
  int states = 10000;    ///< of every message
  int in_flight = 16;    ///< most calls under way on a connection, where the server allows so many
  double seconds = 5;    ///< of each load
  double settle_s = 10;  ///< of silence after the last
  int deadline_ms = 1000;                ///< of every call
  int server_core = 0, client_core = 1;  ///< -1: not pinned
  bool heeds_hints = false;  ///< a connection that was refused waits as long as it was told
  unsigned seed = 1;         ///< of the states and the arrivals
};

/// One load: calls over all connections at random (Poisson), or, closed, one call under way on
/// each connection, the next when it ends, or, where it was refused, after the time that the
/// refusal told.
struct OverloadRow {
  std::string load;           ///< "closed", "0.8", "2"
  double offered_per_s = 0;   ///< calls that the load asks for
  double answered_per_s = 0;  ///< in time, of those sent
  double refused_per_s = 0;   ///< RESOURCE_EXHAUSTED
  double late_per_s = 0;      ///< DEADLINE_EXCEEDED, or answered after the deadline
  double failed_per_s = 0;    ///< any other end
  /// Not sent: the connection had as many calls open as it may, or waits as it was told.
  double held_per_s = 0;
  double p50_ms = 0, p99_ms = 0;                  ///< from sending to the answer
  double refused_p50_ms = 0, refused_p99_ms = 0;  ///< from sending to the refusal
  double most_rss_mib = 0;                        ///< of the server meanwhile
};

struct OverloadResult {
  std::vector<OverloadRow> rows;
  std::vector<double> rss_mib;  ///< of the server, every half second
  double start_rss_mib = 0;     ///< after every connection had its first answers
  double end_rss_mib = 0;       ///< after the silence

  // What the targets are about.
  double goodput = 0;    ///< answered at load 2, over the closed loop's
  double p99_ratio = 0;  ///< at load 2 over that at 0.8
  double most_rss_mib = 0;
  double rss_ratio = 0;  ///< end over start

  /// Each that is missed, by what was asked and found.
  std::vector<std::string> Missed() const;
};

/// Starts a server on a core of its own, measures how much it answers in a closed loop, then sends
/// 0.8 and 2 times as much. Throws std::runtime_error.
OverloadResult MeasureOverload(const OverloadOptions& options);

}  // namespace grouser::bench
