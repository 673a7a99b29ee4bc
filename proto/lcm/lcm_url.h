#pragma once

#include <netinet/in.h>

#include <string>

namespace grouser::lcm_io {

/// A "udpm://GROUP:PORT?ttl=T&recv_buf_size=B" URL of LCM.
struct LcmUrl {
  in_addr group{};        ///< IPv4 multicast address, network order
  in_port_t port = 0;     ///< host order
  int ttl = 0;            ///< 0: messages do not leave this machine
  int receive_bytes = 0;  ///< of the kernel's buffer; 0: as the kernel has it

  std::string GroupText() const;
  /// The URL again, with every part: what liblcm is given to publish by.
  std::string Text() const;
};

/// `url` if given, else $LCM_DEFAULT_URL, else liblcm's own default,
/// udpm://239.255.76.67:7667?ttl=0.
std::string EffectiveLcmUrl(const std::string& url);

/// "udpm://" alone is the default group and port. Throws std::runtime_error
/// "lcm: 'URL': ..., expected ..." for another provider (its receiver would be
/// liblcm's, which hostile bytes can end), a group that is no multicast
/// address, a port of 0 or an option that LCM does not have.
LcmUrl ParseLcmUrl(const std::string& url);

}  // namespace grouser::lcm_io
