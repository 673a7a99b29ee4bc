#pragma once

#include <chrono>
#include <string>

namespace grouser::server {

/// Settings of grouser-server. No hidden defaults: these are all.
struct ServerConfig {
  std::string state_dir;                         ///< holds models/; written by others
  std::string shipped_dir;                       ///< read-only underlay; may be empty
  std::string grpc_address = "127.0.0.1:50151";  ///< HOST:PORT; port 0: a free one
  bool lcm = true;
  std::string lcm_url;  ///< empty: $LCM_DEFAULT_URL, else liblcm's default
  /// LCM messages that come in by another network interface are not received.
  std::string lcm_interface = "lo";
  std::string port_file;  ///< receives "grpc=ADDR"; empty: none
  /// How often the repository is looked at.
  std::chrono::milliseconds poll_period{200};
  /// How long a drain waits for messages under way.
  std::chrono::milliseconds drain_limit{2000};
  int max_receive_bytes = 4 * 1024 * 1024;
  /// Streams and calls under way on one connection.
  int max_calls_per_connection = 128;

  /// Throws std::invalid_argument "key: value, expected ...".
  void Validate() const;
};

/// $GROUSER_STATE, else $XDG_STATE_HOME/grouser, else ~/.local/state/grouser.
/// Empty when the environment names none of them.
std::string DefaultStateDir();

}  // namespace grouser::server
