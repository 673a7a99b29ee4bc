#include "clients/cpp/lcm_client.h"

#include <lcm/lcm-cpp.hpp>
#include <unistd.h>

#include <random>
#include <stdexcept>

namespace grouser::client {
namespace {

constexpr const char* kQueryChannel = "GROUSER_QUERY";
constexpr const char* kResponseChannel = "GROUSER_RESPONSE";

std::string UniqueSender() {
  std::random_device random;
  return "client-" + std::to_string(::getpid()) + "-" + std::to_string(random());
}

}  // namespace

struct LcmClient::Impl {
  explicit Impl(const std::string& url) : lcm(url) {}

  void OnResponse(const lcm::ReceiveBuffer*, const std::string&,
                  const grouser_lcm::wheel_response_t* response) {
    if (response->sender == sender && response->sequence == sequence) answer = *response;
  }

  lcm::LCM lcm;
  std::string sender = UniqueSender();
  std::int64_t sequence = 0;
  std::optional<grouser_lcm::wheel_response_t> answer;
};

LcmClient::LcmClient(const std::string& url) : impl_(std::make_unique<Impl>(url)) {
  if (!impl_->lcm.good()) {
    throw std::runtime_error("lcm: '" + url + "': liblcm cannot use this URL");
  }
  if (impl_->lcm.subscribe(kResponseChannel, &Impl::OnResponse, impl_.get()) == nullptr) {
    throw std::runtime_error(
        "lcm: cannot receive; without a multicast route give this machine one with\n"
        "  ip link set lo multicast on\n  ip route add 224.0.0.0/4 dev lo");
  }
}

LcmClient::~LcmClient() = default;

std::optional<grouser_lcm::wheel_response_t> LcmClient::Query(grouser_lcm::wheel_query_t* query,
                                                              Milliseconds timeout) {
  using Clock = std::chrono::steady_clock;
  const auto deadline = Clock::now() + timeout;
  impl_->answer.reset();
  query->sender = impl_->sender;
  query->sequence = ++impl_->sequence;
  query->utime = std::chrono::duration_cast<std::chrono::microseconds>(
                     std::chrono::system_clock::now().time_since_epoch())
                     .count();
  if (impl_->lcm.publish(kQueryChannel, query) != 0) {
    throw std::runtime_error("lcm: the query could not be sent");
  }
  while (!impl_->answer) {
    const auto left = std::chrono::duration_cast<Milliseconds>(deadline - Clock::now());
    if (left.count() <= 0) return std::nullopt;
    if (impl_->lcm.handleTimeout(static_cast<int>(left.count())) < 0) {
      throw std::runtime_error("lcm: receiving failed");
    }
  }
  if (!impl_->answer->error.empty()) throw std::runtime_error("lcm: " + impl_->answer->error);
  return impl_->answer;
}

}  // namespace grouser::client
