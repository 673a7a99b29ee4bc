#include "server/net/listener.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <spdlog/spdlog.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <stdexcept>

#include "proto/records/os/unique_fd.h"

namespace grouser::server {
namespace {

namespace asio = boost::asio;
using boost::system::error_code;

// A pause ends when a client leaves, which nothing announces.
constexpr std::chrono::milliseconds kPause(50);
constexpr std::chrono::seconds kBetweenWarnings(10);
// Accepted in one turn of the loop, which has other work as well.
constexpr int kBurst = 64;
// A peer that takes no data for so long is gone.
constexpr int kUserTimeoutMs = 20000;

[[noreturn]] void Fail(const std::string& what, const Address& address,
                       const std::string& problem) {
  throw std::runtime_error(what + ": " + address.Text() + ": " + problem);
}

std::pair<dev_t, ino_t> IdentityOf(const std::string& path) {
  struct stat file {};
  if (::lstat(path.c_str(), &file) != 0) return {};
  return {file.st_dev, file.st_ino};
}

int PortOf(const asio::generic::stream_protocol::endpoint& endpoint) {
  sockaddr_in address{};  // the port of sockaddr_in6 stands at the same place
  std::memcpy(&address, endpoint.data(), sizeof address);
  return ntohs(address.sin_port);
}

/// Removes the socket file of a server that is no more. Throws for anything else.
void RemoveStaleSocket(asio::io_context& loop, const std::string& what, const Address& address) {
  struct stat file {};
  if (::lstat(address.path.c_str(), &file) != 0) return;
  if (!S_ISSOCK(file.st_mode)) Fail(what, address, "exists and is no socket");
  asio::local::stream_protocol::socket probe(loop);
  error_code error;
  probe.open(asio::local::stream_protocol(), error);
  // A live server with a full queue must not look dead, nor make this wait.
  if (!error) probe.non_blocking(true, error);
  if (!error) probe.connect(asio::local::stream_protocol::endpoint(address.path), error);
  if (error != asio::error::connection_refused) {
    Fail(what, address,
         !error || error == asio::error::try_again ? "cannot listen: in use by another program"
                                                   : "cannot listen: " + error.message());
  }
  ::unlink(address.path.c_str());
}

}  // namespace

Listener::Listener(asio::io_context& loop, Address address, std::size_t max_connections,
                   Deliver deliver, std::string what)
    : loop_(loop),
      address_(std::move(address)),
      deliver_(std::move(deliver)),
      what_(std::move(what)),
      connections_(max_connections) {
  address_.is_unix() ? ListenUnix() : ListenTcp();
}

Listener::~Listener() { Stop(); }

Listener::Acceptor& Listener::Open(const asio::generic::stream_protocol::endpoint& endpoint) {
  Acceptor& acceptor = ports_.emplace_back(loop_).acceptor;
  acceptor.open(endpoint.protocol());
  ::fcntl(acceptor.native_handle(), F_SETFD, FD_CLOEXEC);
  acceptor.non_blocking(true);
  if (!address_.is_unix()) acceptor.set_option(asio::socket_base::reuse_address(true));
  acceptor.bind(endpoint);
  return acceptor;
}

void Listener::ListenTcp() {
  using asio::ip::tcp;
  error_code error;
  const auto found = tcp::resolver(loop_).resolve(address_.host, std::to_string(address_.port),
                                                  tcp::resolver::passive, error);
  if (error) Fail(what_, address_, "cannot listen: " + error.message());
  std::string problem = "no such address";
  for (const auto& entry : found) {
    tcp::endpoint endpoint = entry.endpoint();
    endpoint.port(static_cast<unsigned short>(address_.port));  // the first's, where it was 0
    try {
      Acceptor& acceptor = Open(endpoint);
      acceptor.listen();
      address_.port = PortOf(acceptor.local_endpoint());
    } catch (const boost::system::system_error& e) {
      ports_.pop_back();
      problem = e.code().message();
      // A name may stand for a family of addresses that this machine lacks, but
      // not for a port that is half another program's.
      if (e.code() != asio::error::address_in_use) continue;
      ports_.clear();
      break;
    }
  }
  if (ports_.empty()) Fail(what_, address_, "cannot listen: " + problem);
}

void Listener::ListenUnix() {
  const auto folder = std::filesystem::absolute(address_.path).parent_path();
  // Locked, so that of two servers which start at the same time only one judges and
  // replaces a socket file.
  const os::UniqueFd guard(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (guard.valid()) ::flock(guard.get(), LOCK_EX);
  RemoveStaleSocket(loop_, what_, address_);
  try {
    Acceptor& acceptor = Open(asio::local::stream_protocol::endpoint(address_.path));
    socket_file_ = IdentityOf(address_.path);
    ::chmod(address_.path.c_str(), S_IRUSR | S_IWUSR);  // before anybody can connect
    acceptor.listen();
  } catch (const boost::system::system_error& e) {
    Fail(what_, address_, "cannot listen: " + e.code().message());
  }
}

void Listener::Start() {
  for (Port& port : ports_) WaitFor(port);
}

void Listener::WaitFor(Port& port) {
  port.acceptor.async_wait(asio::socket_base::wait_read, [this, &port](const error_code& error) {
    if (!error && !stopped_) AcceptSome(port);
  });
}

void Listener::AcceptSome(Port& port) {
  auto last = Accepted::kOne;
  for (int i = 0; i < kBurst && last == Accepted::kOne; ++i) last = AcceptOne(port.acceptor);
  if (last != Accepted::kNoRoom) return WaitFor(port);
  port.pause.expires_after(kPause);
  port.pause.async_wait([this, &port](const error_code& error) {
    if (!error && !stopped_) AcceptSome(port);
  });
}

Listener::Accepted Listener::AcceptOne(Acceptor& acceptor) {
  if (connections_.IsFull()) {
    WarnFull("the largest number of connections is open");
    return Accepted::kNoRoom;
  }
  const int fd =
      ::accept4(acceptor.native_handle(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
  if (fd < 0) {
    // These but the first concern one client that has gone already.
    if (errno != EAGAIN && errno != EINTR && errno != ECONNABORTED && errno != EPROTO) {
      WarnFull(std::strerror(errno));  // no descriptor, no memory: it may pass
      return Accepted::kNoRoom;
    }
    full_ = false;
    return errno == EAGAIN ? Accepted::kNone : Accepted::kOne;
  }
  full_ = false;
  if (!address_.is_unix()) {
    const int on = 1, timeout_ms = kUserTimeoutMs;
    ::setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    ::setsockopt(fd, IPPROTO_TCP, TCP_USER_TIMEOUT, &timeout_ms, sizeof timeout_ms);
  }
  connections_.Add(fd);
  deliver_(acceptor.native_handle(), fd);
  return Accepted::kOne;
}

void Listener::WarnFull(const std::string& why) {
  full_ = true;
  const auto now = std::chrono::steady_clock::now();
  if (now - last_warning_ < kBetweenWarnings) return;
  last_warning_ = now;
  spdlog::warn("{}: {}: new clients wait: {}", what_, address_.Text(), why);
}

void Listener::Stop() {
  if (std::exchange(stopped_, true)) return;
  for (Port& port : ports_) {
    while (AcceptOne(port.acceptor) == Accepted::kOne) {
    }
  }
  if (!ports_.empty() && address_.is_unix() && IdentityOf(address_.path) == socket_file_) {
    ::unlink(address_.path.c_str());
  }
  ports_.clear();
}

}  // namespace grouser::server
