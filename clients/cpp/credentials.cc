#include "clients/cpp/credentials.h"

#include <grpc/grpc_security_constants.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>

namespace grouser::client {
namespace {

std::string ReadText(const char* option, const std::string& path, const char* expected) {
  errno = 0;
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;
  if (in) text << in.rdbuf();  // fails where there is nothing to copy, without an error
  const int error = errno;
  if (!in || (!text && error != 0)) {
    throw std::invalid_argument(std::string(option) + ": " + path + ": " +
                                (error != 0 ? std::strerror(error) : "cannot be read"));
  }
  if (text.str().empty()) {
    throw std::invalid_argument(std::string(option) + ": " + path + ": is empty, expected " +
                                expected);
  }
  return text.str();
}
std::string ReadPem(const char* option, const std::string& path) {
  return ReadText(option, path, "PEM");
}

std::string ReadToken(const std::string& path) {
  std::string token = ReadText("--token-file", path, "a token");
  constexpr const char* kBlanks = " \t\r\n";
  token.erase(0, token.find_first_not_of(kBlanks));
  token.erase(token.find_last_not_of(kBlanks) + 1);
  for (const char c : token) {
    if (c > ' ' && c <= '~') continue;
    throw std::invalid_argument("--token-file: " + path + ": expected one word of ASCII");
  }
  if (token.empty())
    throw std::invalid_argument("--token-file: " + path + ": is empty, expected a token");
  return token;
}

class TokenPlugin final : public grpc::MetadataCredentialsPlugin {
 public:
  explicit TokenPlugin(const std::string& token) : value_("Bearer " + token) {}
  bool IsBlocking() const override { return false; }
  grpc::Status GetMetadata(grpc::string_ref, grpc::string_ref, const grpc::AuthContext&,
                           std::multimap<grpc::string, grpc::string>* metadata) override {
    metadata->emplace("authorization", value_);
    return grpc::Status::OK;
  }

 private:
  const std::string value_;
};

std::shared_ptr<grpc::ChannelCredentials> WithToken(
    const std::shared_ptr<grpc::ChannelCredentials>& channel, const std::string& file) {
  if (file.empty()) return channel;
  return grpc::CompositeChannelCredentials(
      channel, grpc::experimental::MetadataCredentialsFromPlugin(
                   std::make_unique<TokenPlugin>(ReadToken(file)), GRPC_SECURITY_NONE));
}

}  // namespace

bool IsLocal(const std::string& address) {
  for (const char* start : {"localhost:", "127.", "[::1]:", "unix:"}) {
    if (address.starts_with(start)) return true;
  }
  return false;
}

std::shared_ptr<grpc::ChannelCredentials> MakeCredentials(const Server& server) {
  const Access& access = server.access;
  if (access.tls_cert.empty() != access.tls_key.empty()) {
    throw std::invalid_argument("--tls-cert: expected with --tls-key, and the other way round");
  }
  if (!access.tls_ca.empty()) {
    grpc::SslCredentialsOptions options;
    options.pem_root_certs = ReadPem("--tls-ca", access.tls_ca);
    if (!access.tls_cert.empty()) {
      options.pem_cert_chain = ReadPem("--tls-cert", access.tls_cert);
      options.pem_private_key = ReadPem("--tls-key", access.tls_key);
    }
    return WithToken(grpc::SslCredentials(options), access.token_file);
  }
  if (!access.tls_cert.empty()) {
    throw std::invalid_argument("--tls-cert: expected with --tls-ca, by which to know the server");
  }
  if (access.token_file.empty()) return grpc::InsecureChannelCredentials();
  if (!IsLocal(server.address)) {
    throw std::invalid_argument("--token-file: " + server.address +
                                " is another machine, and the token would go there in plaintext; "
                                "expected --tls-ca");
  }
  // These refuse to go off the machine, whatever the address turns out to be.
  const bool is_unix = server.address.starts_with("unix:");
  return WithToken(grpc::experimental::LocalCredentials(is_unix ? UDS : LOCAL_TCP),
                   access.token_file);
}

}  // namespace grouser::client
