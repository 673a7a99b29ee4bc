#pragma once

#include <string>

namespace grouser::client {

/// How a client shows who it is, and knows the server. Paths; empty: none.
struct Access {
  std::string tls_ca;             ///< PEM of who signs the server's certificate: speak TLS
  std::string tls_cert, tls_key;  ///< PEM; shown to the server, both or neither
  std::string token_file;         ///< its text, blanks at the ends aside, goes with every call
};

/// A server and the way to it.
struct Server {
  std::string address;  ///< HOST:PORT or unix:PATH
  Access access;
};

}  // namespace grouser::client
