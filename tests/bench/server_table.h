#pragma once

#include "tests/bench/job_bench.h"
#include "tests/bench/server_bench.h"

namespace grouser::bench {

/// Each row with its target beside it, met or missed.
void PrintTable(const ServerResult& result);
void PrintJson(const ServerResult& result);
void PrintTable(const JobResult& result);
void PrintJson(const JobResult& result);

}  // namespace grouser::bench
