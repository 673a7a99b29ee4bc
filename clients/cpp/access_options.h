#pragma once

#include <CLI/CLI.hpp>

#include "clients/cpp/access.h"

namespace grouser::client {

/// The options of all command lines that speak to a server.
inline void AddAccessOptions(CLI::App& app, Access* access) {
  app.add_option("--tls-ca", access->tls_ca,
                 "Certificates in PEM of who signs the server's: speak TLS")
      ->envname("GROUSER_TLS_CA");
  app.add_option("--tls-cert", access->tls_cert, "Certificate in PEM that shows who asks")
      ->envname("GROUSER_TLS_CERT");
  app.add_option("--tls-key", access->tls_key, "Its key in PEM")->envname("GROUSER_TLS_KEY");
  app.add_option("--token-file", access->token_file, "File of the token that shows who asks")
      ->envname("GROUSER_TOKEN_FILE");
}

}  // namespace grouser::client
