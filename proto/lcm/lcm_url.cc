#include "proto/lcm/lcm_url.h"

#include <arpa/inet.h>
#include <fmt/format.h>

#include <charconv>
#include <cstdlib>
#include <stdexcept>
#include <string_view>

namespace grouser::lcm_io {
namespace {

constexpr std::string_view kScheme = "udpm://";
constexpr std::string_view kDefaultHost = "239.255.76.67:7667";

[[noreturn]] void Refuse(const std::string& url, const std::string& what) {
  throw std::runtime_error(fmt::format("lcm: '{}': {}", url, what));
}

int Number(const std::string& url, std::string_view what, std::string_view text, int low,
           int high) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || value < low || value > high) {
    Refuse(url, fmt::format("{}: '{}', expected a number from {} to {}", what, text, low, high));
  }
  return value;
}

/// Takes what stands before the first `separator` away from `rest`.
std::string_view Take(std::string_view* rest, char separator) {
  const std::size_t at = rest->find(separator);
  const std::string_view part = rest->substr(0, at);
  *rest = at == std::string_view::npos ? std::string_view() : rest->substr(at + 1);
  return part;
}

void SetOption(const std::string& url, std::string_view option, LcmUrl* out) {
  constexpr int kMaxBytes = 1 << 30;
  std::string_view value = option;
  const std::string_view key = Take(&value, '=');
  if (key == "ttl") {
    out->ttl = Number(url, key, value, 0, 255);
  } else if (key == "recv_buf_size") {
    out->receive_bytes = Number(url, key, value, 0, kMaxBytes);
  } else if (key != "transmit_only") {  // obsolete in liblcm, which ignores it
    Refuse(url, fmt::format("option '{}', expected ttl or recv_buf_size", key));
  }
}

}  // namespace

std::string LcmUrl::GroupText() const {
  char text[INET_ADDRSTRLEN] = "";
  ::inet_ntop(AF_INET, &group, text, sizeof text);
  return text;
}

std::string LcmUrl::Text() const {
  return fmt::format("{}{}:{}?ttl={}", kScheme, GroupText(), port, ttl);
}

std::string EffectiveLcmUrl(const std::string& url) {
  if (!url.empty()) return url;
  const char* variable = std::getenv("LCM_DEFAULT_URL");
  if (variable != nullptr && *variable != '\0') return variable;
  return fmt::format("{}{}?ttl=0", kScheme, kDefaultHost);
}

LcmUrl ParseLcmUrl(const std::string& url) {
  std::string_view options = url;
  if (!options.starts_with(kScheme)) {
    Refuse(url, "expected udpm://GROUP:PORT with a multicast IPv4 address");
  }
  options.remove_prefix(kScheme.size());
  std::string_view port = Take(&options, '?');
  if (port.empty()) port = kDefaultHost;
  const std::string host(Take(&port, ':'));
  LcmUrl out;
  if (::inet_pton(AF_INET, host.c_str(), &out.group) != 1 ||
      !IN_MULTICAST(ntohl(out.group.s_addr))) {
    Refuse(url, "expected udpm://GROUP:PORT with a multicast IPv4 address");
  }
  out.port = static_cast<in_port_t>(Number(url, "port", port, 1, 65535));
  while (!options.empty()) SetOption(url, Take(&options, '&'), &out);
  return out;
}

}  // namespace grouser::lcm_io
