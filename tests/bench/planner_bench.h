#pragma once

#include <string>
#include <vector>

namespace grouser::bench {

struct PlannerOptions {
  /// grouser-server with the shipped vehicles, which plans the same paths by turns; empty: none.
  std::string server;
  std::string vehicle, path;  ///< these rows alone; empty: all
  int repetitions = 100;      ///< plans of every row, interleaved
  std::size_t points = 1000;  ///< of every path
};

/// A vehicle along a path, in this process on one thread.
struct PlannerRow {
  std::string vehicle, path;  ///< path: "straight", "curvy", "hilly", "mixed"
  std::size_t points = 0, wheels = 0;
  double plan_p50_ms = 0, plan_p99_ms = 0;  ///< wall clock
  double plan_cpu_ms = 0;                   ///< processor time, median
  /// One solve, amortised over those of all points with the speeds of the plan: from nothing, and
  /// from the solutions at 1 % less speed. Processor time, medians.
  double solve_cold_us = 0, solve_warm_us = 0;
  double solve_draw_us = 0;  ///< of the second on a draw of the ground, from that of the mean
  long allocations = 0;      ///< of a plan and all solves
  std::size_t not_held = 0;  ///< points at which the plan does not hold
  /// The same by a server, from request to answer [ms]; 0 without one.
  double grpc_p50_ms = 0, grpc_p99_ms = 0;
  std::size_t grpc_differ = 0;  ///< points whose plan is not that of this process, bit for bit
};

/// Throws what ReadVehicle does, and std::runtime_error where the shipped files are not found.
std::vector<PlannerRow> MeasurePlanner(const PlannerOptions& options);

}  // namespace grouser::bench
