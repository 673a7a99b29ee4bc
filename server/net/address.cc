#include "server/net/address.h"

#include <fmt/format.h>
#include <sys/un.h>

#include <boost/asio/ip/address.hpp>
#include <charconv>
#include <stdexcept>

namespace grouser::server {
namespace {

constexpr int kMaxPort = 65535;
constexpr std::size_t kMaxPath = sizeof(sockaddr_un::sun_path) - 1;

[[noreturn]] void Fail(const std::string& text) {
  throw std::invalid_argument(
      fmt::format("grpc: '{}', expected HOST:PORT with a port from 0 to {}, or unix:PATH with a "
                  "path of 1 to {} bytes",
                  text, kMaxPort, kMaxPath));
}

}  // namespace

bool Address::is_local() const {
  if (is_unix() || host == "localhost") return true;
  boost::system::error_code error;
  const auto address = boost::asio::ip::make_address(host, error);
  return !error && address.is_loopback();  // of other names nobody knows what they mean tomorrow
}

std::string Address::Text() const {
  if (is_unix()) return "unix:" + path;
  const bool is_v6 = host.find(':') != std::string::npos;
  return (is_v6 ? "[" + host + "]" : host) + ":" + std::to_string(port);
}

Address ParseAddress(const std::string& text) {
  Address address;
  if (text.starts_with("unix:")) {
    address.path = text.substr(text.starts_with("unix:///") ? 7 : 5);
    if (address.path.empty() || address.path.size() > kMaxPath) Fail(text);
    return address;
  }
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos || colon == 0) Fail(text);
  address.host = text.substr(0, colon);
  if (address.host.starts_with('[') && address.host.ends_with(']')) {
    address.host = address.host.substr(1, address.host.size() - 2);
  } else if (address.host.find(':') != std::string::npos) {
    Fail(text);  // an IPv6 address needs brackets
  }
  const char* end = text.data() + text.size();
  const auto [rest, bad] = std::from_chars(text.data() + colon + 1, end, address.port);
  if (address.host.empty() || bad != std::errc() || rest != end || address.port < 0 ||
      address.port > kMaxPort || text[colon + 1] == '-') {
    Fail(text);
  }
  return address;
}

}  // namespace grouser::server
