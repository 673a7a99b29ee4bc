#pragma once

#include <string>

#include "clients/cli/commands.h"
#include "grouser/v1alpha1/jobs_service.pb.h"

namespace grouser::cli {

/// One line of the table: job, state, share of the running stage, ETA, and what it is or says; at
/// most `columns` bytes, without control characters.
std::string JobLine(const v1alpha1::Job& job, int columns);

/// Follows the newest `limit` jobs until none of them is queued or at work. On a terminal one table
/// that is drawn anew; else a line (with --json the message) each time a job has changed.
int WatchAll(const Common& common, int limit);

}  // namespace grouser::cli
