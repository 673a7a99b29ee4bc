#pragma once

#include <string>

namespace grouser::server {

/// Contents of the files that TLS needs, in PEM.
struct TlsMaterial {
  std::string certificates;  ///< the server's, then those that sign it
  std::string key;
  std::string client_ca;  ///< who signs clients' certificates; empty: nobody asks

  bool operator==(const TlsMaterial&) const = default;
};

struct TlsFiles {
  std::string certificates, key, client_ca;  ///< paths; empty: none

  bool given() const { return !certificates.empty(); }
};

/// Reads and checks: the certificate is valid now and its key fits. Throws
/// std::runtime_error "--tls-cert: FILE: what is wrong, what was expected".
TlsMaterial ReadTls(const TlsFiles& files);

}  // namespace grouser::server
