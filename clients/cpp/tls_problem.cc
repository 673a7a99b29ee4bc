#include <arpa/inet.h>
#include <netdb.h>
#include <openssl/err.h>
#include <openssl/ssl.h>
#include <openssl/x509_vfy.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstring>
#include <memory>

#include "clients/cpp/credentials.h"

namespace grouser::client {
namespace {

constexpr timeval kTimeout{.tv_sec = 2, .tv_usec = 0};

template <auto Free>
struct Freed {
  template <class T>
  void operator()(T* object) const {
    Free(object);
  }
};

class Socket {
 public:
  explicit Socket(const std::string& address) {
    address.starts_with("unix:") ? ConnectUnix(address) : ConnectTcp(address);
  }
  ~Socket() {
    if (fd_ >= 0) ::close(fd_);
  }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;

  int fd() const { return fd_; }
  /// As certificates name it.
  const std::string& host() const { return host_; }

 private:
  void ConnectTcp(const std::string& address) {
    const std::size_t colon = address.rfind(':');
    if (colon == std::string::npos) return;
    host_ = address.substr(0, colon);
    if (host_.starts_with('[') && host_.ends_with(']')) host_ = host_.substr(1, host_.size() - 2);
    addrinfo hints{};
    hints.ai_socktype = SOCK_STREAM;
    addrinfo* found = nullptr;
    if (::getaddrinfo(host_.c_str(), address.substr(colon + 1).c_str(), &hints, &found) != 0)
      return;
    const std::unique_ptr<addrinfo, Freed<freeaddrinfo>> freed(found);
    for (const addrinfo* a = found; a != nullptr && fd_ < 0; a = a->ai_next) {
      Connect(a->ai_family, a->ai_addr, a->ai_addrlen);
    }
  }
  void ConnectUnix(const std::string& address) {
    host_ = "localhost";
    const std::string path = address.substr(address.starts_with("unix:///") ? 7 : 5);
    sockaddr_un to{};
    to.sun_family = AF_UNIX;
    if (path.size() >= sizeof to.sun_path) return;
    std::memcpy(to.sun_path, path.data(), path.size());
    Connect(AF_UNIX, reinterpret_cast<const sockaddr*>(&to), sizeof to);
  }
  void Connect(int family, const sockaddr* to, socklen_t size) {
    fd_ = ::socket(family, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (fd_ < 0) return;
    ::setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &kTimeout, sizeof kTimeout);
    ::setsockopt(fd_, SOL_SOCKET, SO_SNDTIMEO, &kTimeout, sizeof kTimeout);
    if (::connect(fd_, to, size) == 0) return;
    ::close(fd_);
    fd_ = -1;
  }

  int fd_ = -1;
  std::string host_;
};

using Context = std::unique_ptr<SSL_CTX, Freed<SSL_CTX_free>>;
using Session = std::unique_ptr<SSL, Freed<SSL_free>>;

/// Whether the server speaks TLS; `verified` receives what its certificate lacks.
bool ShakesHands(const Socket& socket, const std::string& ca, long* verified) {
  const Context context(SSL_CTX_new(TLS_client_method()));
  if (!ca.empty()) SSL_CTX_load_verify_locations(context.get(), ca.c_str(), nullptr);
  const Session session(SSL_new(context.get()));
  SSL_set_verify(session.get(), SSL_VERIFY_NONE, nullptr);  // goes on, and tells in the end
  in6_addr number{};
  const char* host = socket.host().c_str();
  if (::inet_pton(AF_INET, host, &number) == 1 || ::inet_pton(AF_INET6, host, &number) == 1) {
    X509_VERIFY_PARAM_set1_ip_asc(SSL_get0_param(session.get()), host);
  } else {
    SSL_set1_host(session.get(), host);
    SSL_set_tlsext_host_name(session.get(), host);
  }
  static constexpr unsigned char kH2[] = {2, 'h', '2'};
  SSL_set_alpn_protos(session.get(), kH2, sizeof kH2);
  SSL_set_fd(session.get(), socket.fd());
  const bool done = SSL_connect(session.get()) == 1;
  *verified = SSL_get_verify_result(session.get());
  ERR_clear_error();
  return done;
}

}  // namespace

std::string TlsProblem(const Server& server) {
  const Socket socket(server.address);
  if (socket.fd() < 0) return "";
  const std::string& ca = server.access.tls_ca;
  long verified = X509_V_OK;
  const bool speaks_tls = ShakesHands(socket, ca, &verified);
  if (ca.empty()) return speaks_tls ? "it speaks TLS: expected --tls-ca" : "";
  if (!speaks_tls)
    return "it does not speak TLS: expected no --tls-ca, or a server with --tls-cert";
  if (verified == X509_V_OK) return "";
  return "its certificate: " + std::string(X509_verify_cert_error_string(verified)) +
         " (authority by --tls-ca: " + ca + ")";
}

}  // namespace grouser::client
