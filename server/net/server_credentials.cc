#include "server/net/server_credentials.h"

#include <grpc/grpc.h>
#include <grpc/grpc_security.h>
#include <grpc/slice.h>
#include <grpcpp/security/tls_certificate_provider.h>
#include <grpcpp/security/tls_certificate_verifier.h>
#include <grpcpp/security/tls_credentials_options.h>
#include <spdlog/spdlog.h>

#include <string>
#include <vector>

namespace grouser::server {
namespace {

std::string_view ToView(const grpc_slice& slice) {
  return {reinterpret_cast<const char*>(GRPC_SLICE_START_PTR(slice)), GRPC_SLICE_LENGTH(slice)};
}

void AddProperties(const grpc_auth_context* peer, const char* name,
                   std::vector<std::string_view>* out) {
  auto values = grpc_auth_context_find_properties_by_name(peer, name);
  while (const grpc_auth_property* p = grpc_auth_property_iterator_next(&values)) {
    out->emplace_back(p->value, p->value_length);
  }
}

struct Gatekeeper {
  AccessPolicy& policy;
  CallRecords& records;
};

/// Of every call, before its service sees it.
void AdmitCall(void* state, grpc_auth_context* peer, const grpc_metadata* metadata, std::size_t n,
               grpc_process_auth_metadata_done_cb done, void* call) {
  auto& [policy, records] = *static_cast<Gatekeeper*>(state);
  std::string_view path, request_id;
  Evidence evidence;
  for (std::size_t i = 0; i < n; ++i) {
    const std::string_view key = ToView(metadata[i].key);
    if (key == ":path") path = ToView(metadata[i].value);
    if (key == "x-request-id") request_id = ToView(metadata[i].value);
    if (key == "authorization") evidence.authorization.push_back(ToView(metadata[i].value));
  }
  AddProperties(peer, GRPC_X509_CN_PROPERTY_NAME, &evidence.certificate_names);
  AddProperties(peer, GRPC_X509_SAN_PROPERTY_NAME, &evidence.certificate_names);
  const grpc::Status status = policy.Admit(path, evidence);
  if (!status.ok()) records.NoRights(path, "", request_id, status);
  done(call, nullptr, 0, nullptr, 0, static_cast<grpc_status_code>(status.error_code()),
       status.ok() ? nullptr : status.error_message().c_str());
}

class PolicyCredentials final : public grpc::ServerCredentials {
 public:
  PolicyCredentials(const TlsFiles& tls, AccessPolicy& policy, CallRecords& records)
      : keeper_{policy, records} {
    if (!tls.given()) return;
    std::vector<std::string> files = {tls.certificates, tls.key};
    if (!tls.client_ca.empty()) files.push_back(tls.client_ca);
    tls_ = std::make_unique<Reloaded<TlsMaterial>>("tls", std::move(files),
                                                   [tls] { return ReadTls(tls); });
  }

  void SetAuthMetadataProcessor(const std::shared_ptr<grpc::AuthMetadataProcessor>&) override {}

 private:
  int AddPortToServer(const std::string& address, grpc_server* server) override {
    grpc_server_credentials* credentials =
        tls_ ? MakeTls() : grpc_insecure_server_credentials_create();
    if (keeper_.policy.restricts()) {
      grpc_server_credentials_set_auth_metadata_processor(
          credentials, {.process = AdmitCall, .destroy = nullptr, .state = &keeper_});
    }
    const int port = grpc_server_add_http2_port(server, address.c_str(), credentials);
    grpc_server_credentials_release(credentials);
    return port;
  }

  /// A caller without a certificate gets through the handshake but into no
  /// method but health: only so can the program, and what watches it, ask for
  /// its health, and only so can tokens and certificates stand side by side.
  grpc_server_credentials* MakeTls() {
    const bool asks = !tls_->Current()->client_ca.empty();
    return grpc_ssl_server_credentials_create_with_options(
        grpc_ssl_server_credentials_create_options_using_config_fetcher(
            asks ? GRPC_SSL_REQUEST_CLIENT_CERTIFICATE_AND_VERIFY
                 : GRPC_SSL_DONT_REQUEST_CLIENT_CERTIFICATE,
            [](void* self, grpc_ssl_server_certificate_config** config) {
              return static_cast<PolicyCredentials*>(self)->Fetch(config);
            },
            this));
  }

  /// Before each handshake.
  grpc_ssl_certificate_config_reload_status Fetch(grpc_ssl_server_certificate_config** config) {
    const auto now = tls_->Current();
    const std::lock_guard lock(mutex_);
    if (given_ && *given_ == *now) return GRPC_SSL_CERTIFICATE_CONFIG_RELOAD_UNCHANGED;
    const grpc_ssl_pem_key_cert_pair pair{now->key.c_str(), now->certificates.c_str()};
    // gRPC 1.51 aborts without authorities; where no certificate is asked for, they mean nothing.
    const std::string& authorities = now->client_ca.empty() ? now->certificates : now->client_ca;
    *config = grpc_ssl_server_certificate_config_create(authorities.c_str(), &pair, 1);
    given_ = now;
    return GRPC_SSL_CERTIFICATE_CONFIG_RELOAD_NEW;
  }

  Gatekeeper keeper_;
  std::unique_ptr<Reloaded<TlsMaterial>> tls_;  // null: plaintext
  std::mutex mutex_;
  std::shared_ptr<const TlsMaterial> given_;  // to gRPC, under mutex_
};

}  // namespace

std::shared_ptr<grpc::ServerCredentials> MakeServerCredentials(const TlsFiles& tls,
                                                               AccessPolicy& policy,
                                                               CallRecords& records) {
  return std::make_shared<PolicyCredentials>(tls, policy, records);
}

std::shared_ptr<grpc::ChannelCredentials> MakeProbeCredentials(const TlsFiles& tls) {
  if (!tls.given()) return grpc::InsecureChannelCredentials();
  using namespace grpc::experimental;
  TlsChannelCredentialsOptions options;
  options.set_verify_server_certs(false);
  options.set_check_call_host(false);
  options.set_certificate_verifier(std::make_shared<NoOpCertificateVerifier>());
  // Some certificate is needed: else gRPC wants those of the system, which may have none.
  options.set_certificate_provider(
      std::make_shared<StaticDataCertificateProvider>(ReadTls(tls).certificates));
  options.watch_root_certs();
  return TlsCredentials(options);
}

}  // namespace grouser::server
