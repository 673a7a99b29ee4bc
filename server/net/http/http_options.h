#pragma once

#include <string>

namespace CLI {
class App;
}

namespace grouser::server {

/// How a program serves HTTP to its operators. Both programs take the same options.
struct HttpOptions {
  std::string http;       ///< HOST:PORT (0: a free port) or unix:PATH; empty: none
  bool insecure = false;  ///< also where other machines reach it: no encryption

  void AddTo(CLI::App& app);
  /// Throws std::invalid_argument for an address beyond this machine without `insecure`.
  void Validate() const;
};

}  // namespace grouser::server
