#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace grouser::bench {

struct TrajectoryBenchOptions {
  std::string server;  ///< grouser-server with the vehicle, HOST:PORT or unix:PATH
  std::string vehicle = "husky";
  int trajectories = 200, steps = 50;
  int repetitions = 20;  ///< of every row, interleaved
};

/// The same steps asked of a server in one way.
struct TrajectoryBenchRow {
  std::string way;
  std::size_t calls = 0;
  std::size_t sent_bytes = 0, answered_bytes = 0;  ///< of all messages, on the wire
  double p50_ms = 0;                               ///< of all calls one after the other, wall clock
  double server_p50_ms = 0;                        ///< of these in the server, by its own clock
};

/// Steps' electric powers by Energy and by EvaluateTrajectories have the same bits, or it throws
/// std::runtime_error. Throws client::ClientError.
std::vector<TrajectoryBenchRow> MeasureTrajectories(const TrajectoryBenchOptions& options);

void AddOptions(CLI::App* app, TrajectoryBenchOptions* options, bool* json);
/// For people; for programs.
void PrintTable(const std::vector<TrajectoryBenchRow>& rows);
void PrintJson(const std::vector<TrajectoryBenchRow>& rows);

}  // namespace grouser::bench
