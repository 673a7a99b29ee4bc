#include "server/net/access_policy.h"

#include <fmt/format.h>
#include <grpc/grpc_security_constants.h>
#include <spdlog/spdlog.h>

#include "server/core/model_reference.h"
#include "server/net/address.h"
#include "server/net/header_text.h"

namespace grouser::server {
namespace {

using grpc::StatusCode;

constexpr std::string_view kBearer = "Bearer ";
// Of what a certificate calls its owner.
constexpr std::size_t kMaxCallerName = 128;

grpc::Status Unauthenticated(const std::string& text) {
  return {StatusCode::UNAUTHENTICATED, text};
}

grpc::Status Denied(const Caller& caller, const std::string& what, Role role) {
  return {StatusCode::PERMISSION_DENIED,
          fmt::format("{}: '{}' has the role {}, expected {}", what, caller.name,
                      NameOf(caller.role), NameOf(role))};
}

std::string_view ToView(grpc::string_ref text) { return {text.data(), text.size()}; }

std::string Anonymous(const std::string& host) {
  return host.empty() ? "anonymous" : ("anonymous@" + host).substr(0, kMaxCallerName);
}

}  // namespace

std::string HostOf(const std::string& peer) {
  const std::size_t from = peer.find(':'), port = peer.rfind(':');
  if (!peer.starts_with("ipv") || from == port) return "";
  std::string host = peer.substr(from + 1, port - from - 1);
  for (const std::string bracket : {"%5B", "%5D", "[", "]"}) {
    if (const auto at = host.find(bracket); at != std::string::npos) host.erase(at, bracket.size());
  }
  return host;
}

AccessPolicy::AccessPolicy(const NetOptions& options)
    : unix_(ParseAddress(options.grpc).is_unix()),
      local_(ParseAddress(options.grpc).is_local()),
      tls_(options.tls.given()),
      asks_certificates_(!options.tls.client_ca.empty()) {
  options.Validate();
  if (!local_ && !tls_) {
    spdlog::warn(
        "grpc: --insecure: {} is served in plaintext: whoever is on the way reads and changes it; "
        "no caller is known, and tokens are refused",
        options.grpc);
  }
  if (options.rights.empty()) return;
  rights_ = std::make_unique<Reloaded<Rights>>(
      "rights", std::vector{options.rights}, [file = options.rights] { return ReadRights(file); });
}

grpc::Status AccessPolicy::IdentifyByToken(const Evidence& evidence, const Rights* rights,
                                           Caller* caller) const {
  if (!tls_ && !local_) {
    return Unauthenticated(
        "token: came in plaintext from another machine, so others may know it: replace it, and use "
        "TLS");
  }
  const std::string_view header = evidence.authorization.front();
  if (evidence.authorization.size() > 1 || !header.starts_with(kBearer)) {
    return Unauthenticated("authorization: expected one header 'Bearer TOKEN'");
  }
  if (!IsHeaderText(header)) return Unauthenticated("authorization: expected printable ASCII");
  const auto* entry =
      rights == nullptr ? nullptr : rights->OfToken(std::string(header.substr(kBearer.size())));
  if (entry == nullptr) return Unauthenticated("token: not one of the rights file's");
  *caller = {entry->name, entry->role};
  return grpc::Status::OK;
}

grpc::Status AccessPolicy::Identify(const Evidence& evidence, Caller* caller) {
  const auto rights = rights_ ? rights_->Current() : nullptr;
  if (!evidence.authorization.empty()) return IdentifyByToken(evidence, rights.get(), caller);
  if (rights) {
    for (const std::string_view name : evidence.certificate_names) {
      const auto* entry = rights->OfCertificate(name);
      if (entry == nullptr) continue;
      *caller = {entry->name, entry->role};
      return grpc::Status::OK;
    }
  }
  const bool certified = !evidence.certificate_names.empty();
  caller->name = certified
                     ? std::string(evidence.certificate_names.front().substr(0, kMaxCallerName))
                     : (local_ ? "local" : Anonymous(evidence.host));
  if (rights) {
    caller->role = rights->anyone.value_or(Role::kNone);
  } else {
    caller->role = role_without_file();
  }
  if (certified || (rights && rights->anyone)) return grpc::Status::OK;
  if (rights) {
    return Unauthenticated(asks_certificates_ ? "caller: unknown, expected a certificate or a token"
                                              : "caller: unknown, expected a token");
  }
  return asks_certificates_ ? Unauthenticated("caller: unknown, expected a certificate")
                            : grpc::Status::OK;
}

grpc::Status AccessPolicy::Admit(std::string_view path, const Evidence& evidence) {
  const auto needed = RoleNeeded(path);
  if (!needed) {
    return {StatusCode::PERMISSION_DENIED,
            fmt::format("{}: not in the table of rights, so nobody may call it", Quote(path))};
  }
  if (*needed == Role::kNone) return grpc::Status::OK;
  Caller caller;
  grpc::Status status = Identify(evidence, &caller);
  if (!status.ok()) {
    return {status.error_code(), fmt::format("{}: {}; the role {} is needed", path,
                                             status.error_message(), NameOf(*needed))};
  }
  return caller.role >= *needed ? grpc::Status::OK : Denied(caller, std::string(path), *needed);
}

Caller AccessPolicy::CallerOf(const grpc::CallbackServerContext& context) {
  if (!restricts()) return {"local", Role::kAdmin};
  Evidence evidence;
  std::vector<grpc::string_ref> names;
  const auto peer = context.auth_context();
  for (const char* property : {GRPC_X509_CN_PROPERTY_NAME, GRPC_X509_SAN_PROPERTY_NAME}) {
    const auto values = peer->FindPropertyValues(property);
    names.insert(names.end(), values.begin(), values.end());
  }
  for (const auto& name : names) evidence.certificate_names.push_back(ToView(name));
  const auto [begin, end] = context.client_metadata().equal_range("authorization");
  for (auto header = begin; header != end; ++header) {
    evidence.authorization.push_back(ToView(header->second));
  }
  evidence.host = HostOf(context.peer());
  Caller caller;
  // Rights that changed since the call was admitted count at once.
  return Identify(evidence, &caller).ok() ? caller : Caller{"unknown", Role::kNone};
}

grpc::Status AccessPolicy::Require(const Caller& caller, Role role, const std::string& what) {
  return caller.role >= role ? grpc::Status::OK : Denied(caller, what, role);
}

}  // namespace grouser::server
