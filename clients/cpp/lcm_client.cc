#include "clients/cpp/lcm_client.h"

#include <poll.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <lcm/lcm-cpp.hpp>
#include <random>
#include <stdexcept>

#include "clients/cpp/lcm_response.h"
#include "proto/lcm/group_receiver.h"

namespace grouser::client {
namespace {

constexpr const char* kQueryChannel = "GROUSER_QUERY";
constexpr const char* kResponseChannel = "GROUSER_RESPONSE";
constexpr const char* kMeasuredChannel = "GROUSER_MEASURED";

std::string UniqueSender() {
  std::random_device random;
  return "client-" + std::to_string(::getpid()) + "-" + std::to_string(random());
}

}  // namespace

// liblcm publishes alone: its receiver can be ended by a hostile datagram.
struct LcmClient::Impl {
  Impl(const lcm_io::LcmUrl& url, const std::string& interface)
      : receiver(url, interface), publisher(url.Text()) {}

  /// The answer to what was asked last, if the receiver has it.
  std::optional<grouser_lcm::wheel_response_t> Take() {
    grouser_lcm::wheel_response_t response;
    while (const auto message = receiver.Next()) {
      if (message->channel == kMeasuredChannel) TakeMeasured(message->payload);
      if (message->channel != kResponseChannel) continue;
      if (!DecodeResponse(message->payload, &response)) continue;
      if (response.sender == sender && response.sequence == sequence) return response;
    }
    return std::nullopt;
  }

  /// Comes before the answer that it is about.
  void TakeMeasured(std::span<const std::uint8_t> payload) {
    grouser_lcm::wheel_measured_t got;
    if (!DecodeMeasured(payload, &got)) return;
    if (got.sender == sender && got.sequence == sequence) measured = std::move(got);
  }

  lcm_io::GroupReceiver receiver;
  lcm::LCM publisher;
  std::string sender = UniqueSender();
  std::int64_t sequence = 0;
  grouser_lcm::wheel_measured_t measured{};  ///< of what was asked last; n 0: none
};

LcmClient::LcmClient(const std::string& url, const std::string& interface)
    : impl_(std::make_unique<Impl>(lcm_io::ParseLcmUrl(lcm_io::EffectiveLcmUrl(url)), interface)) {
  if (!impl_->publisher.good()) {
    throw std::runtime_error("lcm: '" + url + "': liblcm cannot use this URL");
  }
}

LcmClient::~LcmClient() = default;

std::optional<grouser_lcm::wheel_response_t> LcmClient::Query(
    grouser_lcm::wheel_query_t* query, Milliseconds timeout,
    grouser_lcm::wheel_measured_t* measured) {
  using Clock = std::chrono::steady_clock;
  const auto deadline = Clock::now() + timeout;
  query->sender = impl_->sender;
  query->sequence = ++impl_->sequence;
  impl_->measured = {};
  query->utime = std::chrono::duration_cast<std::chrono::microseconds>(
                     std::chrono::system_clock::now().time_since_epoch())
                     .count();
  if (impl_->publisher.publish(kQueryChannel, query) != 0) {
    throw std::runtime_error("lcm: the query could not be sent");
  }
  while (true) {
    const auto left = std::chrono::duration_cast<Milliseconds>(deadline - Clock::now());
    if (left.count() <= 0) return std::nullopt;
    pollfd waiting{impl_->receiver.fd(), POLLIN, 0};
    if (::poll(&waiting, 1, static_cast<int>(left.count())) < 0 && errno != EINTR) {
      throw std::runtime_error(std::string("lcm: poll: ") + std::strerror(errno));
    }
    const auto answer = impl_->Take();
    if (!answer) continue;
    if (!answer->error.empty()) throw std::runtime_error("lcm: " + answer->error);
    if (measured) *measured = std::move(impl_->measured);
    return answer;
  }
}

}  // namespace grouser::client
