#pragma once

#include <grpcpp/server_context.h>
#include <grpcpp/support/status.h>

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "server/net/method_rights.h"
#include "server/net/net_options.h"
#include "server/net/reloaded.h"
#include "server/net/rights_file.h"

namespace grouser::server {

/// What a call brings to show who it is of.
struct Evidence {
  std::vector<std::string_view> certificate_names;  ///< verified: CN, then SANs
  std::vector<std::string_view> authorization;      ///< values of that header
  std::string host = "";                            ///< of the peer; empty: not known
};

/// Of a peer as gRPC names it ("ipv4:192.0.2.1:40122"), without the port; empty: it has none.
std::string HostOf(const std::string& peer);

struct Caller {
  std::string
      name;  ///< of the rights file, else of the certificate, else "local" or "anonymous@HOST"
  Role role = Role::kNone;
};

/// Who may call what. Without a rights file the address listened on decides: on one of this
/// machine alone all calls may do everything, on any other all may read. Thread-safe.
class AccessPolicy {
 public:
  /// Reads the rights file. Logs a warning where plaintext leaves the machine.
  /// Throws std::invalid_argument where that was not asked for,
  /// records::InputError for a damaged rights file.
  explicit AccessPolicy(const NetOptions& options);

  /// False where every caller may do everything: calls need no look then.
  bool restricts() const { return rights_ || tls_ || !local_; }

  /// Whether there is a rights file.
  bool has_file() const { return rights_ != nullptr; }
  /// Whether gRPC listens where the program's own user alone reaches it: a Unix socket.
  bool is_of_user() const { return unix_; }
  /// What a caller of whom nothing is known may do without a rights file.
  Role role_without_file() const { return local_ ? Role::kAdmin : Role::kRead; }

  /// Whether the call of "/SERVICE/METHOD" may go on. UNAUTHENTICATED or
  /// PERMISSION_DENIED with who, what and the role that is needed.
  grpc::Status Admit(std::string_view path, const Evidence& evidence);

  /// Who an admitted call is of.
  Caller CallerOf(const grpc::CallbackServerContext& context);

  /// PERMISSION_DENIED unless the caller has the role: for what a field of a
  /// request asks beyond its method.
  static grpc::Status Require(const Caller& caller, Role role, const std::string& what);

 private:
  grpc::Status Identify(const Evidence& evidence, Caller* caller);
  grpc::Status IdentifyByToken(const Evidence& evidence, const Rights* rights,
                               Caller* caller) const;

  const bool unix_, local_, tls_, asks_certificates_;
  std::unique_ptr<Reloaded<Rights>> rights_;  // null: no file
};

}  // namespace grouser::server
