#pragma once

#include <string>
#include <vector>

namespace grouser::bench {

struct SurrogateOptions {
  std::string model;     ///< model file; empty: the shipped one
  int repetitions = 21;  ///< of every row, interleaved
  unsigned seed = 1;     ///< of the random states
};

/// One way to evaluate wheel states in-process, on one thread: six outputs with
/// sd_fit, sd_patch, low and high.
struct SurrogateRow {
  std::string kind;  ///< "bekker", "hybrid", "hybrid_exact", "lookup"
  int batch = 0;     ///< states a call
  int outputs = 6;
  bool gradients = false;
  std::string isa;          ///< of the table; "-" for the scalar laws
  double ns_per_state = 0;  ///< median over the repetitions
  long allocations = 0;     ///< in one pass over all states
};

/// A file or folder of the project, in $GROUSER_ROOT or above this program. Throws
/// std::runtime_error where there is none.
std::string FindShipped(const std::string& name);

/// Allocations of this program until now.
long Allocations();

/// Throws std::runtime_error as ReadModelFile and MakeModel do.
std::vector<SurrogateRow> MeasureSurrogate(const SurrogateOptions& options);

}  // namespace grouser::bench
