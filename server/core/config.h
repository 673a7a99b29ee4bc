#pragma once

#include <chrono>
#include <string>
#include <vector>

namespace grouser::server {

/// Settings of grouser-server; those of its gRPC side are NetOptions.
struct ServerConfig {
  std::string state_dir;    ///< holds models/; written by others
  std::string shipped_dir;  ///< read-only underlay; may be empty
  /// Vehicle files, and folders of them.
  std::vector<std::string> vehicles;
  int vehicle_threads = 1;  ///< that answer for them
  /// Most bytes of kept tables, in 1e6; 0: none are kept.
  int table_cache_mb = 2000;
  std::string query_log;         ///< file that answered wheel queries are logged to; empty: none
  int query_log_limit_mb = 100;  ///< most bytes of each such file, in 1e6
  int query_log_files = 5;       ///< that are kept, the one that is written among them
  bool lcm = true;
  std::string lcm_url;  ///< empty: $LCM_DEFAULT_URL, else liblcm's default
  /// LCM messages that come in by another network interface are not received.
  std::string lcm_interface = "lo";
  /// How often the repository is looked at.
  std::chrono::milliseconds poll_period{200};

  /// Throws std::invalid_argument "key: value, expected ...".
  void Validate() const;
};

/// More threads that answer for vehicles are refused.
inline constexpr int kMostVehicleThreads = 64;
/// Of the query log.
inline constexpr int kMostQueryLogMb = 1'000'000, kMostQueryLogFiles = 1000;
/// Half of the processors, 1 to kMostVehicleThreads; `processors` 0: unknown.
int DefaultVehicleThreads(unsigned processors);

/// $GROUSER_STATE, else $XDG_STATE_HOME/grouser, else ~/.local/state/grouser.
/// Empty when the environment names none of them.
std::string DefaultStateDir();

}  // namespace grouser::server
