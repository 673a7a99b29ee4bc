#pragma once

#include <string>

#include "grouser/v1alpha1/jobs_service.pb.h"

namespace grouser::cli {

/// Queued, at DEM, or what follows it: a job that goes on by itself.
bool AtWork(const v1alpha1::Job& job);

/// One line of the table: job, state, share of the running stage, ETA, and what it is or says; at
/// most `columns` bytes, without characters that control a terminal.
std::string JobLine(const v1alpha1::Job& job, int columns);

/// A header and a line a job, the newest first, in at most `rows` lines, each with a line feed;
/// where there is no room for all the last line says how many are left out.
std::string JobTable(const v1alpha1::ListJobsResponse& jobs, int columns, int rows);

}  // namespace grouser::cli
