#pragma once

#include <atomic>
#include <boost/asio/basic_socket_acceptor.hpp>
#include <boost/asio/generic/stream_protocol.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <functional>
#include <list>
#include <string>
#include <utility>

#include "server/net/address.h"
#include "server/net/connection_table.h"

namespace grouser::server {

/// Accepts connections and hands their descriptors on. gRPC 1.51 would accept
/// itself, but stops for good at the first lack of descriptors; this one keeps
/// a number of connections, lets further clients wait in the kernel's queue
/// until one closes, and goes on after every error. Runs on `loop`, one thread.
class Listener {
 public:
  using Acceptor = boost::asio::basic_socket_acceptor<boost::asio::generic::stream_protocol>;
  /// Owns `fd` from then on.
  using Deliver = std::function<void(int listener_fd, int fd)>;

  /// Listens. A Unix socket has mode 0600 (only the server's user); the file of
  /// a dead server is replaced, that of a live one is not. Throws
  /// std::runtime_error "WHAT: ADDR: ..." when it cannot listen. `what`: the
  /// protocol, for messages.
  Listener(boost::asio::io_context& loop, Address address, std::size_t max_connections,
           Deliver deliver, std::string what = "grpc");
  ~Listener();

  void Start();
  /// Accepts who waits already, then listens no more. On the loop's thread, or
  /// when it does not run.
  void Stop();

  /// With the port that was taken.
  const Address& address() const { return address_; }
  /// At the largest number of connections, or out of descriptors.
  bool full() const { return full_; }
  ConnectionTable& connections() { return connections_; }

 private:
  struct Port {
    explicit Port(boost::asio::io_context& loop) : acceptor(loop), pause(loop) {}
    Acceptor acceptor;
    boost::asio::steady_timer pause;
  };
  enum class Accepted { kOne, kNone, kNoRoom };

  void ListenTcp();
  void ListenUnix();
  Acceptor& Open(const boost::asio::generic::stream_protocol::endpoint& endpoint);
  void WaitFor(Port& port);
  void AcceptSome(Port& port);
  Accepted AcceptOne(Acceptor& acceptor);
  void WarnFull(const std::string& why);

  boost::asio::io_context& loop_;
  Address address_;
  Deliver deliver_;
  std::string what_;
  ConnectionTable connections_;
  std::list<Port> ports_;  // one for each address of the host
  std::atomic<bool> full_{false};
  std::chrono::steady_clock::time_point last_warning_{};
  std::pair<dev_t, ino_t> socket_file_{};  // that is ours to remove
  bool stopped_ = false;
};

}  // namespace grouser::server
