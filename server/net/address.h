#pragma once

#include <string>

namespace grouser::server {

/// Where a server listens: HOST:PORT, [IPV6]:PORT or unix:PATH.
struct Address {
  std::string host;  ///< without brackets; empty for a path
  int port = 0;      ///< 0: a free one
  std::string path;  ///< of a Unix domain socket; empty for a host

  bool is_unix() const { return !path.empty(); }
  /// Reached from this machine alone: a path, localhost, or a loopback address.
  bool is_local() const;
  /// As gRPC clients take it.
  std::string Text() const;
};

/// Also takes unix:///PATH. Throws std::invalid_argument with the text and the
/// forms that are expected.
Address ParseAddress(const std::string& text);

}  // namespace grouser::server
