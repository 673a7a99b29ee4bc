#include "server/query/lcm/multicast_probe.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>

namespace grouser::server {
namespace {

constexpr const char* kDefaultUrl = "udpm://239.255.76.67:7667?ttl=0";
constexpr const char* kDefaultGroup = "239.255.76.67";
constexpr int kWaitMs = 500;
constexpr const char* kRemedy =
    "; give this machine a multicast route with\n"
    "  ip link set lo multicast on\n"
    "  ip route add 224.0.0.0/4 dev lo\n"
    "or start with --no-lcm";

class Socket {
 public:
  Socket() : fd_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {}
  ~Socket() {
    if (fd_ >= 0) ::close(fd_);
  }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  int fd() const { return fd_; }

 private:
  int fd_;
};

std::string Refusal(const std::string& group, const std::string& step) {
  return "lcm: multicast to " + group + " does not work here: " + step + kRemedy;
}

std::string GroupOf(const std::string& url) {
  const std::size_t start = url.find("://");
  if (start == std::string::npos) return kDefaultGroup;
  const std::string host = url.substr(start + 3, url.find_first_of(":?/", start + 3) - start - 3);
  return host.empty() ? kDefaultGroup : host;
}

/// Joins the group on a free port; returns the port in network order, or 0
/// with errno set.
in_port_t JoinOnFreePort(int fd, in_addr group) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  ip_mreq membership{group, {htonl(INADDR_ANY)}};
  socklen_t length = sizeof(address);
  const bool joined =
      ::bind(fd, reinterpret_cast<sockaddr*>(&address), sizeof(address)) == 0 &&
      ::setsockopt(fd, IPPROTO_IP, IP_ADD_MEMBERSHIP, &membership, sizeof(membership)) == 0 &&
      ::getsockname(fd, reinterpret_cast<sockaddr*>(&address), &length) == 0;
  return joined ? address.sin_port : 0;
}

}  // namespace

std::string EffectiveLcmUrl(const std::string& url) {
  if (!url.empty()) return url;
  const char* variable = std::getenv("LCM_DEFAULT_URL");
  return variable != nullptr && *variable != '\0' ? variable : kDefaultUrl;
}

std::string ProbeMulticast(const std::string& url) {
  if (!url.starts_with("udpm")) return "";
  const std::string group = GroupOf(url);
  sockaddr_in target{};
  target.sin_family = AF_INET;
  if (::inet_pton(AF_INET, group.c_str(), &target.sin_addr) != 1 ||
      !IN_MULTICAST(ntohl(target.sin_addr.s_addr))) {
    return "lcm: '" + url + "': expected udpm://GROUP:PORT with a multicast IPv4 address";
  }
  const Socket receiver;
  const Socket sender;
  if (receiver.fd() < 0 || sender.fd() < 0) return Refusal(group, std::strerror(errno));
  target.sin_port = JoinOnFreePort(receiver.fd(), target.sin_addr);
  if (target.sin_port == 0) return Refusal(group, std::string("joining: ") + std::strerror(errno));
  const unsigned char ttl = 0;
  const unsigned char loop = 1;
  ::setsockopt(sender.fd(), IPPROTO_IP, IP_MULTICAST_TTL, &ttl, sizeof(ttl));
  ::setsockopt(sender.fd(), IPPROTO_IP, IP_MULTICAST_LOOP, &loop, sizeof(loop));
  const char byte = 'g';
  if (::sendto(sender.fd(), &byte, 1, 0, reinterpret_cast<sockaddr*>(&target), sizeof(target)) !=
      1) {
    return Refusal(group, std::string("sending: ") + std::strerror(errno));
  }
  pollfd waiting{receiver.fd(), POLLIN, 0};
  if (::poll(&waiting, 1, kWaitMs) != 1) return Refusal(group, "a datagram did not come back");
  return "";
}

}  // namespace grouser::server
