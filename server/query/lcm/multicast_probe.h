#pragma once

#include <string>

namespace grouser::server {

/// What liblcm will use: `url` if given, else $LCM_DEFAULT_URL, else liblcm's
/// own default.
std::string EffectiveLcmUrl(const std::string& url);

/// Sends one datagram to the multicast group of a "udpm://GROUP:PORT" URL (on a
/// free port, time to live 0) and waits for it to come back. Empty on success
/// or when the URL is of another provider; else why LCM cannot work here, with
/// the two commands that give a route.
std::string ProbeMulticast(const std::string& url);

}  // namespace grouser::server
