#pragma once

#include "clients/cli/commands.h"

namespace grouser::cli {

/// Follows the newest `limit` jobs until none of them is queued or at work. On a terminal one table
/// that is drawn anew; else a line (with --json the message) each time a job has changed. kExitOk,
/// however they ended.
int WatchAll(const Common& common, int limit);

}  // namespace grouser::cli
