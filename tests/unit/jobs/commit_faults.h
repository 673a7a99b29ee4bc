#pragma once

#include <signal.h>
#include <sqlite3.h>
#include <unistd.h>

#include <string>

namespace grouser::server::testing {

enum class CommitFault { kNone, kKillBefore, kKillAfter, kRefuse };

/// What happens to the commits that this process makes in stores which it opens from now on.
struct CommitPlan {
  CommitFault fault = CommitFault::kNone;
  int at = 0;  ///< counted from 1
  int seen = 0;
};
inline CommitPlan commit_plan;  // NOLINT: SQLite's automatic extensions take no context

inline void PlanCommitFault(CommitFault fault, int at) {
  static constexpr auto on_commit = [](void*) {
    if (++commit_plan.seen != commit_plan.at) return 0;
    if (commit_plan.fault == CommitFault::kKillBefore) ::kill(::getpid(), SIGKILL);
    return commit_plan.fault == CommitFault::kRefuse ? 1 : 0;
  };
  static constexpr auto on_statement_end = [](unsigned, void*, void* statement, void*) {
    const std::string sql = sqlite3_sql(static_cast<sqlite3_stmt*>(statement));
    if (commit_plan.fault == CommitFault::kKillAfter && commit_plan.seen == commit_plan.at &&
        sql.starts_with("COMMIT")) {
      ::kill(::getpid(), SIGKILL);
    }
    return 0;
  };
  constexpr auto on_open = [](sqlite3* db, const char**, const sqlite3_api_routines*) {
    sqlite3_commit_hook(db, on_commit, nullptr);
    return sqlite3_trace_v2(db, SQLITE_TRACE_PROFILE, on_statement_end, nullptr);
  };
  commit_plan = {fault, at};
  int (*const opened)(sqlite3*, const char**, const sqlite3_api_routines*) = on_open;
  sqlite3_auto_extension(reinterpret_cast<void (*)()>(opened));
}

/// Whether there was a fault to come, and it did not.
inline bool CommitFaultIsStillToCome() {
  return commit_plan.fault != CommitFault::kNone && commit_plan.seen < commit_plan.at;
}

}  // namespace grouser::server::testing
