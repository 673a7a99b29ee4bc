#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "proto/lcm/datagram.h"
#include "proto/lcm/lcm_url.h"

namespace grouser::lcm_io {

inline constexpr const char* kLoopbackInterface = "lo";

/// Receives the datagrams of one LCM group on one network interface. liblcm's
/// own receiver (1.3.1) overflows its fragment buffer on a crafted fragment, and
/// takes what comes in by any interface: liblcm publishes, and this receives.
class GroupReceiver {
 public:
  struct Counts {
    std::uint64_t messages = 0, fragments = 0, malformed = 0;
    /// Messages that are missing in the senders' sequences.
    std::uint64_t lost = 0;
  };

  /// Joins the group on `interface` ("lo", "eth0"). Sends one datagram by the
  /// machine's routes, as liblcm will, and waits up to half a second for it to
  /// come back by that interface. Throws std::runtime_error "lcm: ..." with the
  /// commands that give a route when it does not.
  GroupReceiver(const LcmUrl& url, const std::string& interface);
  ~GroupReceiver();
  GroupReceiver(const GroupReceiver&) = delete;
  GroupReceiver& operator=(const GroupReceiver&) = delete;

  /// Readable when a datagram waits.
  int fd() const { return fd_; }

  /// The next message, which is valid until the next call. Never waits: nothing
  /// when none is there, or after many datagrams that are no message. Those are
  /// counted and left out. Any bytes are safe.
  std::optional<Datagram> Next();

  const Counts& counts() const { return counts_; }

 private:
  void CountLost(std::uint64_t sender, std::uint32_t sequence);

  int fd_ = -1;
  Counts counts_;
  std::map<std::uint64_t, std::uint32_t> last_sequence_;  // by address and port
  std::array<std::uint8_t, kMaxDatagram> buffer_;
};

}  // namespace grouser::lcm_io
