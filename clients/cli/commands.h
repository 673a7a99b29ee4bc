#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <memory>

#include "clients/cpp/access.h"

namespace grouser::cli {

inline constexpr int kExitOk = 0;
inline constexpr int kExitFailed = 1;
inline constexpr int kExitUsage = 2;

/// Options that every command shares.
struct Common {
  std::string server = "127.0.0.1:50151";  ///< grouser-server
  /// --server was given and --jobs was not: a command that asks grouser-jobs would ask another
  /// machine than was meant.
  bool server_alone = false;
  std::string jobs = "127.0.0.1:50152";  ///< grouser-jobs
  client::Access access;                 ///< of both
  bool json = false;
  int deadline_ms = 10000;
};

/// Adds commands to `app`; the chosen one stores itself in `*action`, which
/// main runs. An action returns the exit code and may throw.
using Action = std::function<int()>;

/// Address of grouser-jobs. Throws std::invalid_argument where --server was given instead.
const std::string& JobsAddress(const Common& common);
void AddQueryCommands(CLI::App& app, std::shared_ptr<Common> common, Action* action);
/// Below "model", which AddQueryCommands adds, and "prune".
void AddAliasCommands(CLI::App& app, std::shared_ptr<Common> common, Action* action);
void AddJobCommands(CLI::App& app, std::shared_ptr<Common> common, Action* action);
/// Campaigns and calibrations as jobs, and the results of jobs.
void AddWorkCommands(CLI::App& app, std::shared_ptr<Common> common, Action* action);

}  // namespace grouser::cli
