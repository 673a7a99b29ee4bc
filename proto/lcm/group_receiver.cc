#include "proto/lcm/group_receiver.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <net/if.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <utility>

namespace grouser::lcm_io {
namespace {

constexpr int kProbeWaitMs = 500;
constexpr int kMostIgnored = 64;  // datagrams in one call of Next()
constexpr std::size_t kMaxSenders = 256;
constexpr std::uint32_t kMaxGap = 1 << 16;  // more: the sender has started anew

class Socket {
 public:
  Socket() : fd_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)) {}
  ~Socket() {
    if (fd_ >= 0) ::close(fd_);
  }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  int fd() const { return fd_; }
  int Release() { return std::exchange(fd_, -1); }

 private:
  int fd_;
};

[[noreturn]] void Refuse(const LcmUrl& url, const std::string& interface, const std::string& step) {
  throw std::runtime_error(fmt::format(
      "lcm: multicast to {0} does not work on {1}: {2}; give this machine a multicast route with\n"
      "  ip link set {1} multicast on\n"
      "  ip route add 224.0.0.0/4 dev {1}\n"
      "or name the interface of its route by --lcm-interface, or start with --no-lcm",
      url.GroupText(), interface, step));
}

template <class T>
bool Set(int fd, int level, int option, const T& value) {
  return ::setsockopt(fd, level, option, &value, sizeof value) == 0;
}

/// Takes datagrams to `group` and `port` (network order; 0: a free one, which
/// is returned) that come in by that interface alone. 0 with errno on failure.
in_port_t Join(int fd, in_addr group, in_port_t port, unsigned interface) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr = group;  // not INADDR_ANY: no unicast
  address.sin_port = port;
  socklen_t length = sizeof address;
  ip_mreqn membership{};
  membership.imr_multiaddr = group;
  membership.imr_ifindex = static_cast<int>(interface);
  // IP_MULTICAST_ALL is on by default and delivers what any other program of
  // this machine has joined, on any interface.
  const bool joined = Set(fd, SOL_SOCKET, SO_REUSEADDR, 1) &&
                      ::bind(fd, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0 &&
                      Set(fd, IPPROTO_IP, IP_MULTICAST_ALL, 0) &&
                      Set(fd, IPPROTO_IP, IP_ADD_MEMBERSHIP, membership) &&
                      ::getsockname(fd, reinterpret_cast<sockaddr*>(&address), &length) == 0;
  return joined ? address.sin_port : 0;
}

/// Whether what is sent by the machine's routes comes in by the interface.
void Probe(const LcmUrl& url, const std::string& interface, unsigned index) {
  const Socket receiver;
  const Socket sender;
  sockaddr_in target{};
  target.sin_family = AF_INET;
  target.sin_addr = url.group;
  target.sin_port = Join(receiver.fd(), url.group, 0, index);
  if (target.sin_port == 0) {
    Refuse(url, interface, std::string("joining: ") + std::strerror(errno));
  }
  Set<unsigned char>(sender.fd(), IPPROTO_IP, IP_MULTICAST_TTL, 0);
  const char byte = 'g';
  if (::sendto(sender.fd(), &byte, 1, 0, reinterpret_cast<sockaddr*>(&target), sizeof target) !=
      1) {
    Refuse(url, interface, std::string("sending: ") + std::strerror(errno));
  }
  pollfd waiting{receiver.fd(), POLLIN, 0};
  if (::poll(&waiting, 1, kProbeWaitMs) != 1) {
    Refuse(url, interface, "a datagram did not come back by this interface");
  }
}

}  // namespace

GroupReceiver::GroupReceiver(const LcmUrl& url, const std::string& interface) {
  const unsigned index = ::if_nametoindex(interface.c_str());
  if (index == 0) {
    throw std::runtime_error(fmt::format("lcm: interface '{}': {}, expected one such as lo or eth0",
                                         interface, std::strerror(errno)));
  }
  Probe(url, interface, index);
  Socket socket;
  if (Join(socket.fd(), url.group, htons(url.port), index) == 0) {
    Refuse(url, interface, std::string("joining: ") + std::strerror(errno));
  }
  if (url.receive_bytes > 0) Set(socket.fd(), SOL_SOCKET, SO_RCVBUF, url.receive_bytes);
  fd_ = socket.Release();
}

GroupReceiver::~GroupReceiver() { ::close(fd_); }

std::optional<Datagram> GroupReceiver::Next() {
  for (int ignored = 0; ignored < kMostIgnored; ++ignored) {
    sockaddr_in from{};
    socklen_t length = sizeof from;
    const ssize_t size = ::recvfrom(fd_, buffer_.data(), buffer_.size(), MSG_DONTWAIT,
                                    reinterpret_cast<sockaddr*>(&from), &length);
    // An interface that went down is reported once; it may come back.
    if (size < 0) return std::nullopt;
    const Datagram datagram = ParseDatagram({buffer_.data(), static_cast<std::size_t>(size)});
    if (datagram.kind == DatagramKind::kMalformed) {
      ++counts_.malformed;
      continue;
    }
    CountLost(std::uint64_t{from.sin_addr.s_addr} << 16 | from.sin_port, datagram.sequence);
    if (datagram.kind == DatagramKind::kMessage) {
      ++counts_.messages;
      return datagram;
    }
    ++counts_.fragments;
  }
  return std::nullopt;
}

void GroupReceiver::CountLost(std::uint64_t sender, std::uint32_t sequence) {
  const auto known = last_sequence_.find(sender);
  if (known == last_sequence_.end()) {
    if (last_sequence_.size() >= kMaxSenders) last_sequence_.clear();  // forged ones are cheap
    last_sequence_.emplace(sender, sequence);
    return;
  }
  const std::uint32_t step = sequence - known->second;  // 0: the next fragment
  if (step > 1 && step < kMaxGap) counts_.lost += step - 1;
  known->second = sequence;
}

}  // namespace grouser::lcm_io
